//! Work that takes long, on a thread of its own, while Python's looks for signals.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::refused::fault;

/// Between two looks for signals, chosen here: Ctrl-C is felt at once.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Of the thread that works (bytes): as a program's first thread has it.
const STACK_BYTES: usize = 8 << 20;

/// Whether work has been asked to stop.
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asked often by what can stop.
    pub(crate) fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What some work gives. Other Python threads go on meanwhile; a signal's exception is raised at
/// once, and what the work then gives is dropped. Work that never asks whether to stop goes on in
/// the background until it is done.
pub(crate) fn wait<T: Send + 'static>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (send, mut receive) = mpsc::channel();
    let worker = thread::Builder::new().stack_size(STACK_BYTES);
    worker
        .spawn(move || {
            // Without a receiver nothing is told.
            let _ = send.send(work());
        })
        .map_err(fault)?;
    loop {
        let told;
        (receive, told) = py.detach(move || {
            let told = receive.recv_timeout(LOOK_EVERY);
            (receive, told)
        });
        match told {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(fault(
                    "the work ended without an answer; what it said is above",
                ));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(signal) = py.check_signals() {
            stop.0.store(true, Ordering::Relaxed);
            return Err(signal);
        }
    }
}
