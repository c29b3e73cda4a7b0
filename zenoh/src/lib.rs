//! Planners of neighbouring areas of one site ([`service::airspace`]), told of one another over
//! [Zenoh](https://zenoh.io): peers without a broker, over TCP, to addresses that are named.
//! Nothing is looked for by multicast, and no peer is told of third parties.
//!
//! | key expression | what |
//! | --- | --- |
//! | `leeward/SITE/area/AREA/from/OTHER` | what OTHER's planner says to AREA's: one message a sample, as JSON |
//! | `leeward/SITE/area/AREA/border/OTHER` | queryable: what a late OTHER must know of the border |
//!
//! Messages that a link does not take are dropped: what was lost is said again with the next
//! border, a second later at most.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use service::airspace::Neighbours;
use service::airspace::message::{Message, Says};
use thiserror::Error;
use zenoh::qos::CongestionControl;
use zenoh::query::Queryable;
use zenoh::{Config, Session, Wait};

/// Longest message that is read (bytes). Chosen here: the border of a thousand drones.
const MOST_BYTES: usize = 16 << 20;

/// Where a planner is on the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// The site's name, as part of every key expression.
    pub site: String,
    /// The area's.
    pub area: String,
    /// Where others reach this planner, as `tcp/127.0.0.1:7447`.
    pub listen: Vec<String>,
    /// Where it reaches others.
    pub connect: Vec<String>,
}

/// Why there is no link.
#[derive(Debug, Error)]
pub enum LinkError {
    /// A name that cannot be part of a key expression.
    #[error("`{0}` cannot be part of a key expression: letters, digits, `-` and `_` can")]
    Name(String),
    /// What Zenoh says.
    #[error("{0}")]
    Zenoh(#[from] zenoh::Error),
}

/// The last border that was said to each neighbour, as JSON.
type Borders = Arc<Mutex<BTreeMap<String, String>>>;

/// A planner's link to its neighbours.
#[derive(Debug)]
pub struct Zenoh {
    session: Session,
    link: Link,
    /// Messages, and whether each is an answer to what was asked at the beginning.
    received: Receiver<(Message, bool)>,
    /// Areas that have said something since: their answers may be older.
    heard: BTreeSet<String>,
    borders: Borders,
    /// Lives as long as the link.
    _queryable: Queryable<()>,
    sent: u64,
    unsent: u64,
}

impl Zenoh {
    /// Opens a link, and asks those that are there for their borders. Neighbours that are not there
    /// yet are connected to when they come.
    ///
    /// # Errors
    /// A name cannot be part of a key expression, or Zenoh cannot listen there.
    pub fn open(link: Link) -> Result<Zenoh, LinkError> {
        for name in [&link.site, &link.area] {
            let is_plain = |it: char| it.is_ascii_alphanumeric() || it == '-' || it == '_';
            if name.is_empty() || !name.chars().all(is_plain) {
                return Err(LinkError::Name(name.clone()));
            }
        }
        let session = zenoh::open(config(&link)?).wait()?;
        let (sender, received) = channel();
        let key = format!("leeward/{}/area/{}/from/*", link.site, link.area);
        let from_others = sender.clone();
        session
            .declare_subscriber(key)
            .callback(move |sample| forward(&from_others, &sample.payload().to_bytes(), false))
            .background()
            .wait()?;
        let borders = Borders::default();
        let queryable = answer(&session, &link, &borders)?;
        let key = format!("leeward/{}/area/*/border/{}", link.site, link.area);
        session
            .get(key)
            .callback(move |reply| {
                if let Ok(sample) = reply.result() {
                    forward(&sender, &sample.payload().to_bytes(), true);
                }
            })
            .wait()?;
        Ok(Zenoh {
            session,
            link,
            received,
            heard: BTreeSet::new(),
            borders,
            _queryable: queryable,
            sent: 0,
            unsent: 0,
        })
    }

    /// Messages that were sent, and those that Zenoh refused.
    pub fn sent(&self) -> [u64; 2] {
        [self.sent, self.unsent]
    }
}

impl Neighbours for Zenoh {
    fn send(&mut self, message: &Message) {
        let text = serde_json::to_string(message).unwrap_or_default();
        if let Says::Border(_) = message.says {
            let mut borders = self.borders.lock().unwrap_or_else(PoisonError::into_inner);
            borders.insert(message.to.clone(), text.clone());
        }
        let (site, from, to) = (&self.link.site, &message.from, &message.to);
        let key = format!("leeward/{site}/area/{to}/from/{from}");
        let put = self.session.put(key, text);
        let done = put.congestion_control(CongestionControl::Drop).wait();
        match done {
            Ok(()) => self.sent += 1,
            Err(_) => self.unsent += 1,
        }
    }

    fn received(&mut self) -> Vec<Message> {
        let mut all = Vec::new();
        for (message, is_answer) in self.received.try_iter() {
            if !is_answer {
                self.heard.insert(message.from.clone());
            } else if self.heard.contains(&message.from) {
                continue;
            }
            all.push(message);
        }
        all
    }
}

fn config(link: &Link) -> Result<Config, zenoh::Error> {
    let mut config = Config::default();
    let list = |all: &[String]| serde_json::Value::from(all.to_vec()).to_string();
    for (key, value) in [
        ("mode", "\"peer\"".to_owned()),
        ("listen/endpoints", list(&link.listen)),
        ("connect/endpoints", list(&link.connect)),
        ("connect/timeout_ms", "-1".to_owned()),
        ("connect/exit_on_failure", "false".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value)?;
    }
    Ok(config)
}

/// Answers neighbours that come late.
fn answer(session: &Session, link: &Link, borders: &Borders) -> Result<Queryable<()>, LinkError> {
    let prefix = format!("leeward/{}/area/{}/border/", link.site, link.area);
    let borders = borders.clone();
    let queryable = session.declare_queryable(format!("{prefix}*"));
    let queryable = queryable.callback(move |query| {
        let borders = borders
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        for (to, text) in borders {
            let key = format!("{prefix}{to}");
            let is_asked = zenoh::key_expr::KeyExpr::try_from(key.clone())
                .is_ok_and(|it| query.key_expr().intersects(&it));
            if is_asked {
                // An asker that is gone gets none.
                let _ = query.reply(key, text).wait();
            }
        }
    });
    Ok(queryable.wait()?)
}

/// What is no message is dropped: the sender is not heard by it.
fn forward(to: &Sender<(Message, bool)>, bytes: &[u8], is_answer: bool) {
    if bytes.len() <= MOST_BYTES
        && let Ok(message) = serde_json::from_slice(bytes)
    {
        // With its planner gone there is no listener.
        let _ = to.send((message, is_answer));
    }
}
