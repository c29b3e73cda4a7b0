//! A link between two processes that can be blocked: bytes go through, or wait.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::thread;
use std::time::Duration;

/// Takes connections and hands their bytes on to a port (none at 0), until it is blocked: then
/// nothing moves, and connections are neither taken nor ended.
pub(super) fn forward(to: Arc<AtomicU16>, is_blocked: Arc<AtomicBool>) -> io::Result<u16> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let port = listener.local_addr()?.port();
    thread::spawn(move || {
        for here in listener.incoming().flatten() {
            let to = to.load(Ordering::Relaxed);
            let Ok(there) = TcpStream::connect(("127.0.0.1", to)) else {
                continue;
            };
            let both = here.try_clone().and_then(|a| Ok((a, there.try_clone()?)));
            let Ok((back_here, back_there)) = both else {
                continue;
            };
            let blocked = is_blocked.clone();
            thread::spawn(move || pass(here, there, &blocked));
            let blocked = is_blocked.clone();
            thread::spawn(move || pass(back_there, back_here, &blocked));
        }
    });
    Ok(port)
}

fn pass(mut from: TcpStream, mut to: TcpStream, is_blocked: &AtomicBool) {
    let mut bytes = [0; 1 << 16];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        while is_blocked.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(20));
        }
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
    }
    let _ = from.shutdown(std::net::Shutdown::Both);
    let _ = to.shutdown(std::net::Shutdown::Both);
}
