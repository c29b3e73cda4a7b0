//! What has happened to the plan, for all that listen: a client that does not read holds up no
//! other.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use hyper::body::{Body, Bytes, Frame};
use serde_json::Value;
use service::message::{At, Event};
use sha2::{Digest as _, Sha256};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::time::{Interval, interval};

/// Events that are kept for listeners that come back. Chosen here: a minute and a half of ten a
/// second.
const MOST_EVENTS: usize = 1_000;
/// Most bytes of all of them. Chosen here: a tenth of it is a patch of a thousand drones.
const MOST_EVENT_BYTES: usize = 32 << 20;
/// Events that wait for one listener; one that is further behind is dropped. Chosen here: some
/// seconds of ten a second.
const MOST_BEHIND: usize = 64;
/// A comment goes out this often where nothing happens, so that both ends notice when the other is
/// gone. Chosen here: below the minute after which proxies take a silent stream for dead.
const BEAT: Duration = Duration::from_secs(15);

/// Events and listeners.
#[derive(Default)]
pub(super) struct Events {
    inner: Mutex<Inner>,
}

#[derive(Default)]
struct Inner {
    /// The latest, in order: their names, and what goes over the wire.
    kept: VecDeque<(String, Bytes)>,
    bytes: usize,
    listeners: Vec<Sender<Bytes>>,
    /// Of all that a journal keeps of this plan so far: a listener that knows the last event by
    /// name has seen it all.
    digest: [u8; 32],
    /// Of the last event.
    name: Option<String>,
    revision: Option<u64>,
    is_over: bool,
}

impl Events {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // Nothing in here is left half-written by a panic elsewhere.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells all listeners; the number of those that were too far behind.
    pub(super) fn publish(&self, line: &str, event: &Event) -> u64 {
        // A patch of a whole fleet takes its time: no listener waits for that.
        let told = told(event);
        let mut inner = self.lock();
        if matches!(event, Event::Opened(_)) {
            inner.digest = [0; 32];
        }
        let chained = Sha256::new().chain_update(inner.digest);
        inner.digest = chained.chain_update(line).finalize().into();
        let of_event = match event {
            Event::Patch(it) => it.revision,
            Event::Opened(At { revision }) | Event::AskPlan(At { revision }) => {
                revision.unwrap_or(0)
            }
            Event::Closed(it) => it.closed,
        };
        inner.revision = (!matches!(event, Event::Closed(_))).then_some(of_event);
        let [a, b, c, d, ..] = inner.digest;
        let name = format!("{of_event}-{a:02x}{b:02x}{c:02x}{d:02x}");
        let bytes = wire(Some(&name), &told);
        inner.bytes += bytes.len();
        inner.kept.push_back((name.clone(), bytes.clone()));
        inner.name = Some(name);
        while inner.kept.len() > MOST_EVENTS || inner.bytes > MOST_EVENT_BYTES {
            let Some((_, gone)) = inner.kept.pop_front() else {
                break;
            };
            inner.bytes -= gone.len();
        }
        let before = inner.listeners.len();
        let closed = inner.listeners.iter().filter(|it| it.is_closed()).count();
        let sent = |it: &Sender<Bytes>| it.try_send(bytes.clone()).is_ok();
        inner.listeners.retain(sent);
        (before - inner.listeners.len()).saturating_sub(closed) as u64
    }

    /// All that happens from now on, after what has happened since the event of a name.
    pub(super) fn listen(&self, last: Option<&str>) -> Feed {
        let mut inner = self.lock();
        let mut ahead = VecDeque::from([Bytes::from_static(b"retry: 1000\n\n")]);
        match last {
            Some(last) if inner.name.as_deref() != Some(last) => {
                // A plan that was opened again may repeat the names of the one before: the latest.
                let known = inner.kept.iter().rposition(|(name, _)| name == last);
                match known {
                    Some(index) => {
                        let since = inner.kept.iter().skip(index + 1);
                        ahead.extend(since.map(|(_, bytes)| bytes.clone()));
                    }
                    None => {
                        let revision = inner.revision;
                        let ask = Event::AskPlan(At { revision });
                        ahead.push_back(wire(inner.name.as_deref(), &told(&ask)));
                    }
                }
            }
            _ => {}
        }
        let (sender, receiver) = channel(MOST_BEHIND);
        inner.listeners.retain(|it| !it.is_closed());
        if !inner.is_over {
            inner.listeners.push(sender);
        }
        Feed {
            ahead,
            receiver,
            beat: interval(BEAT),
        }
    }

    /// How many listen.
    pub(super) fn listening(&self) -> usize {
        let inner = self.lock();
        inner.listeners.iter().filter(|it| !it.is_closed()).count()
    }

    /// Ends all streams, once what is under way has been read.
    pub(super) fn end(&self) {
        let mut inner = self.lock();
        inner.is_over = true;
        inner.listeners.clear();
    }
}

/// As server-sent events are written (WHATWG HTML, 9.2), but for the name.
fn told(event: &Event) -> String {
    let mut value = serde_json::to_value(event).unwrap_or_default();
    let kind = value["event"].as_str().unwrap_or_default().to_owned();
    let data = value.get_mut("data").map_or(Value::Null, Value::take);
    format!("event: {kind}\ndata: {data}\n\n")
}

fn wire(name: Option<&str>, told: &str) -> Bytes {
    let name = name.map_or(String::new(), |name| format!("id: {name}\n"));
    Bytes::from(name + told)
}

/// The body of an answer that goes on.
pub(super) struct Feed {
    ahead: VecDeque<Bytes>,
    receiver: Receiver<Bytes>,
    beat: Interval,
}

impl Body for Feed {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if let Some(bytes) = self.ahead.pop_front() {
            return Poll::Ready(Some(Ok(Frame::data(bytes))));
        }
        if let Poll::Ready(next) = self.receiver.poll_recv(context) {
            return Poll::Ready(next.map(|bytes| Ok(Frame::data(bytes))));
        }
        ready!(self.beat.poll_tick(context));
        Poll::Ready(Some(Ok(Frame::data(Bytes::from_static(b":\n\n")))))
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        reason = "a test that cannot go on should say where"
    )]

    use http_body_util::BodyExt as _;
    use service::message::Closed;

    use super::*;

    #[test]
    fn a_listener_that_does_not_read_is_dropped_and_the_others_hear_all() {
        let runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = { runtime }.enable_time().build().unwrap();
        runtime.block_on(async {
            let events = Events::default();
            let (mut reads, mut sleeps) = (events.listen(None), events.listen(None));
            let heard = |frame: Option<Result<Frame<Bytes>, Infallible>>| {
                frame.map(|it| it.unwrap().into_data().unwrap())
            };
            let retry = heard(reads.frame().await);
            assert_eq!(retry.unwrap(), "retry: 1000\n\n");
            let mut dropped = 0;
            for closed in 0..200 {
                dropped += events.publish("", &Event::Closed(Closed { closed }));
                let event = heard(reads.frame().await).unwrap();
                let data = format!("event: closed\ndata: {{\"closed\":{closed}}}\n\n");
                assert!(event.ends_with(data.as_bytes()), "{event:?}");
            }
            assert_eq!((dropped, events.listening()), (1, 1));
            let mut last = None;
            let mut count = 0;
            while let Some(bytes) = heard(sleeps.frame().await) {
                (last, count) = (Some(bytes), count + 1);
            }
            // It learns where it was, and may come back there.
            assert_eq!(count, 1 + MOST_BEHIND);
            let last = String::from_utf8(last.unwrap().to_vec()).unwrap();
            let name = last.lines().next().unwrap().trim_start_matches("id: ");
            let again = events.listen(Some(name));
            assert_eq!(again.ahead.len(), 1 + 200 - MOST_BEHIND);
        });
    }

    #[test]
    fn what_is_kept_for_listeners_that_come_back_is_bounded() {
        let runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = { runtime }.enable_time().build().unwrap();
        let _entered = runtime.enter();
        let events = Events::default();
        for closed in 0..MOST_EVENTS as u64 + 5 {
            events.publish("", &Event::Closed(Closed { closed }));
        }
        let inner = events.lock();
        let bytes: usize = inner.kept.iter().map(|(_, it)| it.len()).sum();
        assert_eq!((inner.kept.len(), inner.bytes), (MOST_EVENTS, bytes));
        drop(inner);
        // What came after the first is not known any more.
        let feed = events.listen(Some("0-00000000"));
        assert!(feed.ahead[1].ends_with(b"event: ask_plan\ndata: {\"revision\":null}\n\n"));
    }
}
