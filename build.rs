//! Tells the tests which sets of recordings lie beside the project: they do not ship, and a test
//! that needs one that is absent is counted as ignored. After a set has come or gone:
//! `touch build.rs`.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(shared_recordings, values(any()))");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=LEEWARD_RECORDINGS");
    let folder = env::var_os("LEEWARD_RECORDINGS")
        .map_or_else(|| PathBuf::from("../shared/recordings"), PathBuf::from);
    // `cargo package` unpacks the sources elsewhere: there are none then.
    let Ok(folder) = folder.canonicalize() else {
        return;
    };
    println!("cargo::rustc-env=SHARED_RECORDINGS={}", folder.display());
    let sets = fs::read_dir(&folder).into_iter().flatten().flatten();
    for set in sets.filter(|set| set.path().is_dir()) {
        let name = set.file_name();
        println!(
            "cargo::rustc-cfg=shared_recordings=\"{}\"",
            name.to_string_lossy()
        );
    }
}
