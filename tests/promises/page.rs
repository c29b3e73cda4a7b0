//! plan.html in a real browser: Chromium, where it is installed. `.ci/run` installs it; elsewhere
//! the test says that there is none, and under `CI=true` that is a failure.

use std::fs;
use std::path::Path;
use std::process::Command;

use planner::Plan;
use serde_json::{Value, json};

/// The browser's names on Debian and elsewhere.
const BROWSERS: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// Run as root and without a graphics card; nothing is asked of a network.
const FLAGS: [&str; 13] = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--window-size=1200,800",
    "--virtual-time-budget=8000",
];

/// Looks at the page as a person does, and writes what it saw where the test can read it.
const LOOK: &str = r"<script>
document.addEventListener('securitypolicyviolation', () => { document.documentElement.dataset.refused = 'yes'; });
setTimeout(() => {
  const seen = document.documentElement.dataset, page = window.leeward;
  if (!page) return;
  seen.linked = JSON.stringify([page.now(), page.chosen()]);
  seen.keys = JSON.stringify(['Escape', 'j', 'k', 'End', 'ArrowLeft', 'Home', 'ArrowRight', '.', ' ', ' '].map(key => {
    document.body.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
    return [Math.round(1e4 * page.now()) / 1e4, page.chosen(), document.getElementById('play').textContent];
  }));
  seen.address = decodeURIComponent(location.hash);
  page.seek(MOMENT);
  seen.positions = JSON.stringify(page.drones().map(name => page.position(name)));
  seen.colours = page.colours();
  const at = page.project('NAME'), view = document.getElementById('view');
  for (const kind of ['pointerdown', 'pointerup']) {
    view.dispatchEvent(new PointerEvent(kind, { clientX: at.x, clientY: at.y, bubbles: true, pointerId: 1 }));
  }
  seen.flown = JSON.stringify(page.flown(page.drones()[0]));
  seen.picked = page.chosen();
  seen.said = document.getElementById('panel').innerText;
  seen.loaded = performance.getEntriesByType('resource').length;
}, 500);
</script></body>";

/// What the browser wrote at a key.
fn seen<'a>(dom: &'a str, key: &str) -> Option<&'a str> {
    let mark = format!("data-{key}=\"");
    let rest = &dom[dom.find(&mark)? + mark.len()..];
    Some(&rest[..rest.find('"')?])
}

/// The page of a plan in the browser; `None`: there is no browser.
fn browse(folder: &Path, moment_s: f64, name: &str) -> Option<String> {
    let page = fs::read_to_string(folder.join("plan.html")).unwrap();
    let look = LOOK.replace("MOMENT", &moment_s.to_string());
    let page = page.replace("</body>", &look.replace("NAME", name));
    fs::write(folder.join("looked-at.html"), page).unwrap();
    let dom = BROWSERS.iter().find_map(|browser| {
        let output = Command::new(browser)
            .args(FLAGS)
            .arg(format!(
                "--user-data-dir={}",
                folder.join("profile").display()
            ))
            .arg("--dump-dom")
            .arg(format!(
                "file://{}#t=3.25&drone={name}",
                folder.join("looked-at.html").display()
            ))
            .output()
            .ok()?;
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    });
    if dom.is_none() {
        let is_ci = std::env::var_os("CI").is_some_and(|it| it == "true");
        assert!(!is_ci, "no Chromium: .ci/run installs it");
        eprintln!("plan.html was not opened: there is no Chromium");
    }
    dom
}

/// The page that a subcommand writes of a plan, in the browser; `None`: there is no browser.
fn browse_plan(command: &str, plan: &Value, moment_s: f64, name: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.json");
    fs::write(&path, plan.to_string()).unwrap();
    let out = folder.path().join("out");
    super::succeeds(
        Command::new(env!("CARGO_BIN_EXE_plan"))
            .args([command.as_ref(), path.as_os_str()])
            .arg("--out")
            .arg(&out),
    );
    browse(&out, moment_s, name)
}

#[test]
fn the_page_opens_offline_a_click_picks_and_a_seek_moves_to_what_the_plan_says() {
    let folder = tempfile::tempdir().unwrap();
    for (scenario, picked) in [("warehouse", "survey"), ("circle-16", "circle-1")] {
        let out = folder.path().join(scenario);
        let path = format!("{}/scenarios/{scenario}.ron", env!("CARGO_MANIFEST_DIR"));
        super::succeeds(
            Command::new(env!("CARGO_BIN_EXE_plan"))
                .args([&path, "--no-contrast", "--out"])
                .arg(&out),
        );
        let plan: Plan =
            serde_json::from_str(&fs::read_to_string(out.join("plan.json")).unwrap()).unwrap();
        let picked = plan.drones.iter().find(|it| it.name == picked);
        let picked = &picked.unwrap_or(&plan.drones[0]).name;
        let moment_s = 7.43;
        let Some(dom) = browse(&out, moment_s, picked) else {
            return;
        };
        assert_eq!(seen(&dom, "state"), Some("ready"), "{scenario}");
        assert_eq!((seen(&dom, "error"), seen(&dom, "refused")), (None, None));
        assert_eq!(seen(&dom, "loaded"), Some("0"), "nothing is loaded");
        assert_eq!(seen(&dom, "picked"), Some(&picked[..]));
        let linked: (f64, String) = serde_json::from_str(&unescaped(seen(&dom, "linked"))).unwrap();
        assert_eq!(linked, (3.25, picked.clone()), "the address says so");
        keys_do_what_they_say(&dom, &plan);
        let said = seen(&dom, "said").unwrap();
        assert!(
            said.contains("altitude") && said.contains("may be late"),
            "{said}"
        );
        let colours: usize = seen(&dom, "colours").unwrap().parse().unwrap();
        assert!(colours >= 20, "{colours} colours in the middle");
        let positions: Vec<[f64; 3]> =
            serde_json::from_str(seen(&dom, "positions").unwrap()).unwrap();
        assert_eq!(positions.len(), plan.drones.len());
        for (drone, page_m) in plan.drones.iter().zip(positions) {
            let plan_m = drone.trajectory.position_m(moment_s).unwrap();
            let off_m = (plan_m - nalgebra::Point3::from(page_m)).norm();
            assert!(off_m < 1e-3, "{}: {off_m} m", drone.name);
        }
    }
}

/// An attribute's text as it was written.
fn unescaped(attribute: Option<&str>) -> String {
    attribute.unwrap().replace("&quot;", "\"")
}

/// After each key the time, who is chosen and what the button says, in order of [`LOOK`].
fn keys_do_what_they_say(dom: &str, plan: &Plan) {
    type After = (f64, Option<String>, String);
    let after: Vec<After> = serde_json::from_str(&unescaped(seen(dom, "keys"))).unwrap();
    let name = |k: usize| Some(plan.drones[k].name.clone());
    let chosen: Vec<_> = after.iter().map(|it| it.1.clone()).collect();
    let last = name(plan.drones.len() - 1);
    assert_eq!(chosen[..3], [None, name(0), last.clone()]);
    assert!(chosen[3..].iter().all(|it| *it == last));
    let end_s = after[3].0;
    let ends_s = plan.drones.iter().map(|it| it.trajectory.t_s.last());
    let last_s = ends_s.flatten().copied().fold(0.0, f64::max);
    assert!(end_s >= last_s - 1e-3, "{end_s} of {last_s}");
    let at_s: Vec<f64> = after.iter().map(|it| it.0).collect();
    assert!((at_s[4] - (end_s - 1.0)).abs() < 1e-3, "{at_s:?}");
    assert_eq!(at_s[5..7], [0.0, 1.0]);
    assert!(at_s[7] > 1.0 && at_s[7] < 2.0, "one sample on: {at_s:?}");
    let says: Vec<&str> = after.iter().map(|it| &it.2[..]).collect();
    assert_eq!(says[7..], ["play", "pause", "play"]);
    let address = unescaped(seen(dom, "address")).replace("&amp;", "&");
    let of_last = format!("&drone={}", last.unwrap());
    assert!(
        address.starts_with("#t=1.") && address.ends_with(&of_last),
        "{address}"
    );
}

#[test]
fn the_page_of_a_flight_shows_where_drones_flew() {
    let plan = json!({
        "format": "plan/1", "scenario": "one", "bounds_m": {"min": [0, 0, 0], "max": [20, 20, 8]},
        "drones": [{"name": "a", "airframe": "kolibri", "trajectory": {
            "t_s": [0, 2, 10, 12], "position_m": [[2, 2, 2], [2, 2, 2], [14, 2, 2], [14, 2, 2]],
        }}],
    });
    let Some(dom) = browse_plan("fly", &plan, 3.0, "a") else {
        return;
    };
    assert_eq!(
        (seen(&dom, "state"), seen(&dom, "error")),
        (Some("ready"), None)
    );
    // It has to speed up: it is behind, along its path, by less than what it could have flown.
    let at_m: [f64; 3] = serde_json::from_str(seen(&dom, "flown").unwrap()).unwrap();
    assert!((2.05..3.4).contains(&at_m[0]), "{at_m:?}");
    assert!(
        (at_m[1] - 2.0).abs() < 0.05 && (at_m[2] - 2.0).abs() < 0.1,
        "{at_m:?}"
    );
}

#[test]
fn a_drone_that_leaves_in_the_air_is_not_on_the_ground_when_it_does() {
    let plan = json!({
        "format": "plan/1", "scenario": "one", "bounds_m": {"min": [0, 0, 0], "max": [20, 20, 8]},
        "drones": [{"name": "a", "airframe": "kolibri", "at_end": "leave", "trajectory": {
            "t_s": [0, 8], "position_m": [[2, 2, 6], [10, 2, 6]],
        }}],
    });
    let Some(dom) = browse_plan("check", &plan, 8.0, "a") else {
        return;
    };
    let said = seen(&dom, "said").unwrap();
    assert!(
        said.contains("altitude") && !said.contains("on the ground"),
        "{said}"
    );
}

#[test]
fn a_drone_that_carries_a_load_is_held_to_the_limit_it_has_with_it() {
    let plan = json!({
        "format": "plan/1", "scenario": "load", "bounds_m": {"min": [0, 0, 0], "max": [10, 10, 20]},
        "drones": [
            {"name": "m", "airframe": "matrice-300", "trajectory": {"t_s": [0, 60], "position_m": [[5, 5, 18], [5, 5, 18]]}},
            {"name": "k", "airframe": "kolibri", "trajectory": {
                "t_s": [0, 60], "position_m": [[5, 5, 4.59], [5, 5, 4.59]], "mass_kg": [0.45, 0.45],
            }},
        ],
    });
    let Some(dom) = browse_plan("check", &plan, 30.0, "k") else {
        return;
    };
    assert_eq!(
        (seen(&dom, "state"), seen(&dom, "error")),
        (Some("ready"), None)
    );
    let said = seen(&dom, "said").unwrap();
    let limit_mps = 0.3 * 7.384 * (0.45_f64 / 0.23).sqrt();
    assert!(
        said.contains(&format!("2.6 of {limit_mps:.1} m/s")),
        "{said}"
    );
}

#[test]
fn the_slice_of_a_diagnosis_turns() {
    let folder = tempfile::tempdir().unwrap();
    let recording = format!("{}/recordings/draughty-hall", env!("CARGO_MANIFEST_DIR"));
    let out = folder.path().join("diagnosis");
    super::succeeds(
        Command::new(env!("CARGO_BIN_EXE_plan"))
            .args(["diagnose", &recording, "--out"])
            .arg(&out),
    );
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    let look = r"<script>
addEventListener('error', event => { document.documentElement.dataset.error = event.message; });
setTimeout(() => {
  const seen = document.documentElement.dataset, box = document.querySelector('div.slice'), turn = box.querySelector('input'), near = [];
  for (const azimuth of [0, 60, 120]) { turn.value = azimuth; turn.dispatchEvent(new Event('input')); near.push(Number(box.dataset.near)); }
  const canvas = box.querySelector('canvas'), pen = canvas.getContext('2d'), bytes = pen.getImageData(0, 0, canvas.width, canvas.height).data, colours = new Set();
  for (let k = 0; k < bytes.length; k += 4) colours.add(bytes[k] << 16 | bytes[k + 1] << 8 | bytes[k + 2]);
  seen.near = JSON.stringify(near); seen.colours = colours.size;
}, 300);
</script></body>";
    fs::write(out.join("plan.html"), page.replace("</body>", look)).unwrap();
    let Some(dom) = browse(&out, 0.0, "") else {
        return;
    };
    let near: Vec<u32> = serde_json::from_str(seen(&dom, "near").unwrap()).unwrap();
    assert!(
        near.iter().all(|it| *it > 20) && near[0] != near[1],
        "{near:?}"
    );
    let colours: u32 = seen(&dom, "colours").unwrap().parse().unwrap();
    assert!(colours > 20, "{colours}");
}
