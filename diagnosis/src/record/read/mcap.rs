//! A flight in a bag of ROS 2 (rosbag2, MCAP; mcap.dev, "MCAP format specification"): one or
//! several vehicles, each a part of its topics (`/cf1/pose`) or named in their messages.
//!
//! Known are poses, odometry, transforms, IMU, battery and actuators by their types; any other
//! number by its path in `columns`. The world is ROS's: z up, body x forward, y left (REP 103).

use std::collections::BTreeMap;
use std::io::{BufRead, Read as _};

use mcap::McapError;
use mcap::records::{ChunkHeader, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::campaign::Campaign;
use super::cdr::{Layout, Path, Value};
use super::columns::{Role, RoleOf, Unit, meaning};
use super::conventions::Acceleration;
use super::flight::{recording, vehicle};
use super::found::{Found, Start, did_you_mean, listed};
use super::log::Log;
use super::series::{Sources, Stream, Thinning, joined};
use super::table::thin;
use crate::record::problem::Problem;
use crate::record::recording::Recording;
use crate::record::remark::RemarkKind;

const SOURCES: Sources = Sources {
    acceleration: "sensor_msgs/Imu",
    motors: "actuator_msgs/Actuators, or a topic's path in `columns`",
    battery: "sensor_msgs/BatteryState",
};
/// What a bag begins with.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Longest record, and longest chunk once it is unpacked (bytes). Chosen here: writers make chunks
/// of a megabyte, and one image more is a record of a few.
const LONGEST: usize = 64 << 20;
/// Bytes handed to the reader at a time.
const PIECE: usize = 1 << 16;
/// Most topics listed in a message. Chosen here: a page of them.
const MOST_LISTED: usize = 30;

/// What a field of a message is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Is {
    /// That, in so many SI.
    A(Role, f64),
    /// The vehicle of what follows.
    Name,
    /// The frames of pose and velocity.
    Frame,
    ChildFrame,
    Seconds,
    Nanoseconds,
}

/// Fields of SI with one beginning: that, how they go on, what they are.
type Group = (&'static str, &'static [&'static str], RoleOf);

const XYZ: &[&str] = &[".x", ".y", ".z"];
const XYZW: &[&str] = &[".x", ".y", ".z", ".w"];
const FOUR: &[&str] = &["[0]", "[1]", "[2]", "[3]"];
const ONE: &[&str] = &[""];

/// A type of message that is known.
struct Known {
    of: &'static str,
    groups: &'static [Group],
    others: &'static [(&'static str, Is)],
}

/// The better source of a position first (docs.ros.org, `common_interfaces`, `actuator_msgs`,
/// `mav_msgs`, `px4_msgs`; IMRCLab, `motion_capture_tracking`, `crazyswarm2`).
const KNOWN: [Known; 12] = [
    Known {
        of: "nav_msgs/Odometry",
        groups: &[
            ("pose.pose.position", XYZ, Role::Position),
            ("pose.pose.orientation", XYZW, Role::Quaternion),
            ("twist.twist.linear", XYZ, Role::Velocity),
        ],
        others: &[
            ("header.frame_id", Is::Frame),
            ("child_frame_id", Is::ChildFrame),
        ],
    },
    Known {
        of: "geometry_msgs/PoseStamped",
        groups: &[
            ("pose.position", XYZ, Role::Position),
            ("pose.orientation", XYZW, Role::Quaternion),
        ],
        others: &[],
    },
    Known {
        of: "geometry_msgs/PoseWithCovarianceStamped",
        groups: &[
            ("pose.pose.position", XYZ, Role::Position),
            ("pose.pose.orientation", XYZW, Role::Quaternion),
        ],
        others: &[],
    },
    Known {
        of: "motion_capture_tracking_interfaces/NamedPoseArray",
        groups: &[
            ("poses[*].pose.position", XYZ, Role::Position),
            ("poses[*].pose.orientation", XYZW, Role::Quaternion),
        ],
        others: &[("poses[*].name", Is::Name)],
    },
    Known {
        of: "geometry_msgs/TransformStamped",
        groups: &[
            ("transform.translation", XYZ, Role::Position),
            ("transform.rotation", XYZW, Role::Quaternion),
        ],
        others: &[("child_frame_id", Is::Name)],
    },
    Known {
        of: "tf2_msgs/TFMessage",
        groups: &[
            ("transforms[*].transform.translation", XYZ, Role::Position),
            ("transforms[*].transform.rotation", XYZW, Role::Quaternion),
        ],
        others: &[
            ("transforms[*].header.stamp.sec", Is::Seconds),
            ("transforms[*].header.stamp.nanosec", Is::Nanoseconds),
            ("transforms[*].child_frame_id", Is::Name),
        ],
    },
    Known {
        of: "sensor_msgs/Imu",
        groups: &[("linear_acceleration", XYZ, Role::Acceleration)],
        others: &[],
    },
    Known {
        of: "sensor_msgs/BatteryState",
        groups: &[("voltage", ONE, |_| Role::Battery)],
        others: &[],
    },
    Known {
        of: "crazyflie_interfaces/Status",
        groups: &[("battery_voltage", ONE, |_| Role::Battery)],
        others: &[],
    },
    Known {
        of: "actuator_msgs/Actuators",
        groups: &[
            ("normalized", FOUR, Role::Duty),
            ("velocity", FOUR, Role::RotorSpeed),
        ],
        others: &[],
    },
    Known {
        of: "mav_msgs/Actuators",
        groups: &[
            ("normalized", FOUR, Role::Duty),
            ("angular_velocities", FOUR, Role::RotorSpeed),
        ],
        others: &[],
    },
    Known {
        of: "px4_msgs/ActuatorMotors",
        groups: &[("control", FOUR, Role::Duty)],
        others: &[],
    },
];

impl Known {
    /// Paths of its fields.
    fn fields(&self) -> impl Iterator<Item = (String, Is)> {
        let of_group = |(begin, ends, role): &Group| {
            let (begin, role) = (*begin, *role);
            let ends = ends.iter().enumerate();
            ends.map(move |(axis, end)| (format!("{begin}{end}"), Is::A(role(axis), 1.0)))
        };
        let others = self.others.iter();
        let others = others.map(|(path, is)| ((*path).to_owned(), *is));
        self.groups.iter().flat_map(of_group).chain(others)
    }

    /// Whether its messages say themselves whose their numbers are.
    fn is_named(&self) -> bool {
        self.others.iter().any(|(_, is)| *is == Is::Name)
    }
}

/// Parts of topics that say where a vehicle shall be, not where it is: of RViz and Nav2, of MAVROS,
/// of `mav_msgs` (`default_topics.h`). They are read last.
const ASKED: [&str; 3] = ["goal_pose", "setpoint_position", "command"];

fn is_asked(topic: &str) -> bool {
    topic.split('/').any(|part| ASKED.contains(&part))
}

/// Where most messages say when what they hold was so.
const STAMP: [(&str, Is); 2] = [
    ("header.stamp.sec", Is::Seconds),
    ("header.stamp.nanosec", Is::Nanoseconds),
];

/// A recording from the bytes of a bag.
pub(super) fn mcap(log: Log<'_>, campaign: &Campaign, found: &mut Found) -> Option<Recording> {
    let file = log.file;
    let mut bag = Bag::new(campaign);
    match bag.read(log.bytes) {
        Ok(()) => {}
        Err(error) if bag.messages > 0 => {
            let message = format!("the bag breaks off: {error}; what stands before is read");
            found.remark(RemarkKind::Gap, None, message);
        }
        Err(error) => {
            found.problem(Problem::file(file), format!("is no bag: {error}"));
            return None;
        }
    }
    bag.leave_strange();
    bag.tell(file, found);
    let mut campaign = campaign.clone();
    let is_imu = |topic: &Topic| topic.of == "sensor_msgs/Imu" && topic.whose != Whose::Unknown;
    if bag.channels.values().any(is_imu) {
        campaign
            .acceleration
            .get_or_insert(Acceleration::SpecificForceInBody);
    }
    let mut vehicles = Vec::new();
    let topics = bag.topics();
    for (id, streams) in bag.streams(found) {
        let kind = campaign.vehicles.get(&id);
        let Some(kind) = kind.and_then(|kind| campaign.types.get(kind)) else {
            continue; // checked with the campaign
        };
        let place = streams.iter().find(|stream| stream.has_position());
        if let Some(Stream { name, .. }) = place.filter(|stream| is_asked(&stream.name)) {
            let message = format!(
                "its positions are those that `{name}` asks for: no topic says where it was"
            );
            found.remark(RemarkKind::Assumed, Some(&id), message);
        }
        match joined(&id, streams, &SOURCES, found) {
            Some(samples) => {
                vehicles.extend(vehicle(&id, file, samples, kind, &campaign, found));
            }
            None => {
                let message = "no topic gives its position: not part of the recording";
                found.remark(RemarkKind::Unused, Some(&id), message);
            }
        }
    }
    if vehicles.is_empty() && found.problems.is_empty() {
        let message = "no topic gives a position of a vehicle of the campaign";
        let ids = listed(campaign.vehicles.keys());
        let help = format!(
            "vehicles are {ids}, each a part of its topics or a name in them; topics are {topics}"
        );
        found.helped(Problem::file(file), message, Some(help));
        return None;
    }
    recording(log.name, file, vehicles, &campaign, found)
}

/// Names of the vehicles whose positions a bag holds, sorted: the part of a topic before its last,
/// or what messages call them.
pub(super) fn vehicles(mut bytes: &[u8]) -> Vec<String> {
    let campaign = Campaign::of_no_one();
    let mut bag = Bag::new(&campaign);
    // What stands before it breaks off says enough.
    let _ = bag.read(&mut bytes);
    let of_topic = |topic: &Topic| {
        let is_placed = topic.roles.contains(&Role::Position(0)) && topic.whose != Whose::Named;
        let mut parts = topic.name.rsplit('/').skip(1);
        parts.next().filter(|_| is_placed).map(str::to_owned)
    };
    let mut names: Vec<String> = bag.channels.values().filter_map(of_topic).collect();
    names.extend(bag.strangers.into_keys());
    names.retain(|name| !name.is_empty());
    names.sort();
    names.dedup();
    names
}

/// Whose numbers a topic holds.
#[derive(Clone, Debug, PartialEq)]
enum Whose {
    One(String),
    /// The campaign's only vehicle's, unless one that has it as a part says where it was.
    Only(String),
    /// Said in each message.
    Named,
    Unknown,
}

/// A topic as the bag declares it.
struct Topic {
    name: String,
    /// Of its messages.
    of: String,
    whose: Whose,
    layout: Option<usize>,
    wanted: Vec<Path>,
    is: Vec<Is>,
    /// Roles of its columns.
    roles: Vec<Role>,
    /// Place in [`KNOWN`], after all of them what is [`ASKED`]: what is read first where two topics
    /// say the same.
    rank: usize,
    messages: usize,
    /// Messages that cannot be read, and why the first could not.
    broken: usize,
    why: &'static str,
}

/// Rows of one vehicle from one topic.
#[derive(Default)]
struct Rows {
    /// When the recorder got it, and when it says it was so (ns).
    logged_ns: Vec<i64>,
    stamped_ns: Vec<Option<i64>>,
    columns: Vec<Vec<f64>>,
    thinning: Thinning,
    /// Whether a velocity was turned out of its body.
    has_turned: bool,
}

struct Bag<'c> {
    campaign: &'c Campaign,
    /// Name of each, and which of the layouts.
    schemas: BTreeMap<u16, (String, usize)>,
    layouts: Vec<Result<Layout, String>>,
    channels: BTreeMap<u16, Topic>,
    /// By vehicle, rank and channel.
    rows: BTreeMap<(String, usize, u16), Rows>,
    /// Names in messages that the campaign does not know, and how often.
    strangers: BTreeMap<String, usize>,
    /// Which of the campaign's columns were found.
    found: Vec<bool>,
    messages: usize,
}

impl<'c> Bag<'c> {
    fn new(campaign: &'c Campaign) -> Bag<'c> {
        Bag {
            campaign,
            schemas: BTreeMap::new(),
            layouts: Vec::new(),
            channels: BTreeMap::new(),
            rows: BTreeMap::new(),
            strangers: BTreeMap::new(),
            found: vec![false; campaign.columns.0.len()],
            messages: 0,
        }
    }

    /// Everything up to where the bag ends or breaks off.
    fn read(&mut self, bytes: &mut dyn BufRead) -> Result<(), String> {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(LONGEST);
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event.map_err(said)? {
                LinearReadEvent::ReadRequest(_) => {
                    let read = bytes.read(reader.insert(PIECE));
                    let read = read.map_err(|error| error.to_string())?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    match mcap::parse_record(opcode, data).map_err(said)? {
                        Record::Chunk { header, data } => self.chunk(&header, &data)?,
                        record => self.record(record),
                    }
                }
            }
        }
        Ok(())
    }

    fn chunk(&mut self, header: &ChunkHeader, packed: &[u8]) -> Result<(), String> {
        let unpacked = unpacked(header, packed)?;
        let mut rest = &unpacked[..];
        while let Some((head, more)) = rest.split_first_chunk::<9>() {
            let [opcode, length @ ..] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).ok();
            let body = length.and_then(|length| more.split_at_checked(length));
            let Some((body, more)) = body else {
                return Err("a record is longer than its chunk".to_owned());
            };
            self.record(mcap::parse_record(opcode, body).map_err(said)?);
            rest = more;
        }
        match rest {
            [] => Ok(()),
            _ => Err("a chunk ends within a record".to_owned()),
        }
    }

    fn record(&mut self, record: Record<'_>) {
        match record {
            // Repeated in the summary.
            Record::Schema { header, .. } if self.schemas.contains_key(&header.id) => {}
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data);
                let layout = match header.encoding.as_str() {
                    "ros2msg" => Layout::parse(&header.name, &text),
                    other => Err(format!(
                        "its definition is written as `{other}`, not ros2msg"
                    )),
                };
                let name = header.name.replace("/msg/", "/");
                self.layouts.push(layout);
                let at = self.layouts.len() - 1;
                self.schemas.insert(header.id, (name, at));
            }
            Record::Channel(channel) => {
                let is_known = self.channels.get(&channel.id);
                // Repeated in the summary, and by some writers in every chunk.
                if is_known.is_some_and(|known| known.name == channel.topic) {
                    return;
                }
                let topic = self.topic(channel);
                self.channels.insert(topic.0, topic.1);
            }
            Record::Message { header, data } => {
                self.messages += 1;
                let logged_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                self.message(header.channel_id, logged_ns, &data);
            }
            _ => {}
        }
    }

    /// What a topic is, and what of its messages is read.
    fn topic(&mut self, channel: mcap::records::Channel) -> (u16, Topic) {
        let schema = self.schemas.get(&channel.schema_id);
        let of = schema.map_or("", |(name, _)| name).to_owned();
        let parts: Vec<&str> = channel
            .topic
            .split('/')
            .filter(|of| !of.is_empty())
            .collect();
        let vehicles = &self.campaign.vehicles;
        let at = parts.iter().position(|part| vehicles.get(part).is_some());
        let tail = at.map_or(0, |at| at + 1);
        let tail = parts.get(tail..).unwrap_or_default().join("/");
        let rank = KNOWN.iter().position(|known| known.of == of);
        let known = rank.map(|rank| &KNOWN[rank]);
        let later = match is_asked(&channel.topic) {
            true => KNOWN.len() + 1,
            false => 0,
        };
        let whose = match (at, vehicles.0.as_slice()) {
            _ if known.is_some_and(Known::is_named) => Whose::Named,
            (Some(at), _) => Whose::One(parts[at].to_owned()),
            (None, [(only, _)]) => Whose::Only(only.clone()),
            _ => Whose::Unknown,
        };
        let mut topic = Topic {
            name: channel.topic,
            of,
            whose,
            layout: schema.map(|(_, at)| *at),
            wanted: Vec::new(),
            is: Vec::new(),
            roles: Vec::new(),
            rank: later + rank.unwrap_or(KNOWN.len()),
            messages: 0,
            broken: 0,
            why: "",
        };
        let layout = topic.layout.and_then(|at| self.layouts[at].as_ref().ok());
        let (Some(layout), "cdr") = (layout, channel.message_encoding.as_str()) else {
            return (channel.id, topic);
        };
        let mut asked: Vec<(String, Is)> = Vec::new();
        for ((ours, theirs), is_found) in self.campaign.columns.0.iter().zip(&mut self.found) {
            let path = theirs
                .strip_prefix(&format!("{tail}."))
                .filter(|_| at.is_some());
            let path = path.or_else(|| theirs.strip_prefix(&format!("{}.", topic.name)));
            let is = meaning(ours).filter(|(role, _)| *role != Role::Time);
            let (Some(path), Some((role, unit))) = (path, is) else {
                continue;
            };
            if layout.path(path).is_some() {
                *is_found = true;
                let factor = match unit {
                    Unit::Times(factor) => factor,
                    Unit::Gravities => self.campaign.gravity_mps2(),
                };
                asked.push((path.to_owned(), Is::A(role, factor)));
            }
        }
        asked.extend(known.into_iter().flat_map(Known::fields));
        if !asked.iter().any(|(_, is)| matches!(is, Is::A(..))) {
            return (channel.id, topic);
        }
        asked.extend(STAMP.map(|(path, is)| (path.to_owned(), is)));
        for (path, is) in asked {
            let is_said = |role| topic.roles.contains(&role);
            let (Some(path), false) = (
                layout.path(&path),
                matches!(is, Is::A(role, _) if is_said(role)),
            ) else {
                continue;
            };
            if let Is::A(role, _) = is {
                topic.roles.push(role);
            }
            topic.wanted.push(path);
            topic.is.push(is);
        }
        (channel.id, topic)
    }

    fn message(&mut self, channel: u16, logged_ns: i64, data: &[u8]) {
        let Some(topic) = self.channels.get_mut(&channel) else {
            return;
        };
        topic.messages += 1;
        let layout = topic.layout.and_then(|at| self.layouts[at].as_ref().ok());
        let (Some(layout), false) = (layout, topic.roles.is_empty()) else {
            return;
        };
        let mut rows: Vec<Row<'_>> = Vec::new();
        let mut stamp = [None; 2];
        let width = topic.roles.len();
        let mut row = Row::new(width);
        let mut seen = vec![false; topic.is.len()];
        let is = &topic.is;
        let roles = &topic.roles;
        let walked = layout.visit(data, &topic.wanted, |number, value| {
            // Seen again: another element of the array.
            if std::mem::replace(&mut seen[number], true) {
                rows.push(std::mem::replace(&mut row, Row::new(width)));
                seen.fill(false);
                seen[number] = true;
            }
            match (is[number], value) {
                (Is::A(role, factor), Value::Number(value)) => {
                    let column = roles.iter().position(|of| *of == role);
                    if let Some(column) = column {
                        row.values[column] = value * factor;
                    }
                }
                (Is::Seconds, Value::Number(value)) => stamp[0] = Some(value),
                (Is::Nanoseconds, Value::Number(value)) => stamp[1] = Some(value),
                (Is::Name, Value::Text(text)) => row.name = Some(text),
                (Is::Frame, Value::Text(text)) => row.frame = text,
                (Is::ChildFrame, Value::Text(text)) => row.child = text,
                _ => {}
            }
            if let [Some(seconds), Some(nanoseconds)] = stamp {
                // Whole numbers of at most 32 bits.
                row.stamp_ns = Some(seconds as i64 * 1_000_000_000 + nanoseconds as i64);
            }
        });
        if let Err(why) = walked {
            topic.broken += 1;
            if topic.broken == 1 {
                topic.why = why;
            }
            return;
        }
        rows.push(row);
        let rank = topic.rank;
        for mut row in rows {
            let id = match (&topic.whose, row.name) {
                (Whose::One(id) | Whose::Only(id), _) => id.as_str(),
                (Whose::Named, Some(name)) => name.trim_start_matches('/'),
                _ => continue,
            };
            if self.campaign.vehicles.get(id).is_none() {
                *self.strangers.entry(id.to_owned()).or_default() += 1;
                continue;
            }
            // An array without motors in it says nothing of them.
            if row.values.iter().all(|value| value.is_nan()) {
                continue;
            }
            let key = (id.to_owned(), rank, channel);
            let rows = self.rows.entry(key).or_default();
            if !row.child.is_empty() && row.child != row.frame {
                rows.has_turned |= row.turn_velocity(roles);
            }
            rows.columns.resize(width, Vec::new());
            if !rows.thinning.keeps() {
                continue;
            }
            rows.logged_ns.push(logged_ns);
            rows.stamped_ns.push(row.stamp_ns.filter(|ns| *ns != 0));
            for (column, value) in rows.columns.iter_mut().zip(row.values) {
                column.push(value);
            }
            if let Some(keep) = rows.thinning.leaves(rows.logged_ns.len()) {
                thin(&mut rows.logged_ns, &keep);
                thin(&mut rows.stamped_ns, &keep);
                rows.columns
                    .iter_mut()
                    .for_each(|column| thin(column, &keep));
            }
        }
    }

    /// Where a topic that has the only vehicle as a part says where it was, those without are not
    /// its, but for those that the campaign names in full.
    fn leave_strange(&mut self) {
        let says_where = |(.., channel): &(String, usize, u16)| {
            let topic = &self.channels[channel];
            let is_placed = topic.roles.contains(&Role::Position(0)) && !is_asked(&topic.name);
            is_placed && matches!(topic.whose, Whose::One(_))
        };
        if !self.rows.keys().any(says_where) {
            return;
        }
        let columns = &self.campaign.columns.0;
        for topic in self.channels.values_mut() {
            let begin = format!("{}.", topic.name);
            let is_named = columns.iter().any(|(_, theirs)| theirs.starts_with(&begin));
            if matches!(topic.whose, Whose::Only(_)) && !is_named {
                topic.whose = Whose::Unknown;
            }
        }
        let channels = &self.channels;
        self.rows
            .retain(|(.., channel), _| channels[channel].whose != Whose::Unknown);
    }

    /// What was met and is not used, or not as it stands.
    fn tell(&self, file: &str, found: &mut Found) {
        for ((ours, theirs), _) in self
            .campaign
            .columns
            .0
            .iter()
            .zip(&self.found)
            .filter(|of| !of.1)
        {
            let names = self.channels.values().map(|topic| topic.name.as_str());
            let message = format!("is in no topic, though `columns` takes `{ours}` from it");
            let topic = theirs.split('.').next().unwrap_or_default();
            let help = did_you_mean(topic, names).or_else(|| {
                Some("write the topic behind its vehicle, a point, and the path: \"motors.values[0]\"".into())
            });
            found.helped(Problem::field(file, theirs), message, help);
        }
        for topic in self.channels.values().filter(|topic| topic.broken > 0) {
            let message = format!(
                "{} of {} messages of {} cannot be read: {}",
                topic.broken, topic.messages, topic.name, topic.why
            );
            found.remark(RemarkKind::Impossible, None, message);
        }
        for topic in self.channels.values() {
            let layout = topic.layout.map(|at| self.layouts[at].as_ref());
            if let Some(Err(why)) = layout {
                let message = format!("topic {} is not read: {why}", topic.name);
                found.remark(RemarkKind::Unused, None, message);
            }
        }
        let is_unused = |topic: &&Topic| {
            (topic.roles.is_empty() || topic.whose == Whose::Unknown) && topic.messages > 0
        };
        let unused: Vec<&str> = self
            .channels
            .values()
            .filter(is_unused)
            .map(|topic| topic.name.as_str())
            .collect();
        if !unused.is_empty() {
            let shown = listed(unused.iter().copied().take(MOST_LISTED));
            let message = format!("topics of {file} that are not used: {shown}");
            found.remark(RemarkKind::Unused, None, message);
        }
        if !self.strangers.is_empty() {
            let names = listed(self.strangers.keys().map(String::as_str).take(MOST_LISTED));
            let message = format!("poses of {names}, who are not in the campaign, are not used");
            found.remark(RemarkKind::Unused, None, message);
        }
        for ((_, _, channel), rows) in &self.rows {
            rows.thinning.tell(&self.channels[channel].name, found);
        }
        if self.rows.values().any(|rows| rows.has_turned) {
            let message = "velocities of odometry are taken as in the frame of the body (REP 105) and turned into the world";
            found.remark(RemarkKind::Assumed, None, message);
        }
    }

    fn topics(&self) -> String {
        let one = |topic: &Topic| format!("{} ({})", topic.name, topic.of);
        let all: Vec<String> = self.channels.values().map(one).collect();
        let shown = listed(all.iter().map(String::as_str).take(MOST_LISTED));
        match all.len() {
            0 => "none".to_owned(),
            _ => shown,
        }
    }

    /// Streams of each vehicle on one clock: that of the messages where all say it, else the
    /// recorder's.
    fn streams(self, found: &mut Found) -> BTreeMap<String, Vec<Stream>> {
        let mut all = self.rows.values().flat_map(|rows| &rows.stamped_ns);
        let is_stamped = all.all(Option::is_some);
        let times_ns = |rows: &Rows| -> Vec<i64> {
            match is_stamped {
                true => rows.stamped_ns.iter().flatten().copied().collect(),
                false => rows.logged_ns.clone(),
            }
        };
        let first = self
            .rows
            .values()
            .filter_map(|rows| times_ns(rows).into_iter().min());
        let start_ns = first.min().unwrap_or(0);
        found.starts = Some(Start {
            at_s: start_ns as f64 * 1e-9,
            within_s: 0.0,
        });
        let mut streams: BTreeMap<String, Vec<Stream>> = BTreeMap::new();
        for ((id, _, channel), rows) in self.rows {
            let times_ns = times_ns(&rows);
            // A bag keeps its messages as they came, not as they were sent.
            let mut in_time: Vec<usize> = (0..times_ns.len()).collect();
            in_time.sort_by_key(|&row| times_ns[row]);
            let since_s = |&row: &usize| times_ns[row].saturating_sub(start_ns) as f64 * 1e-9;
            let Topic { name, roles, .. } = &self.channels[&channel];
            let roles = roles.iter().copied();
            // What no message of a topic holds is not there.
            let columns = roles.zip(rows.columns);
            let there = columns.filter(|(_, column)| !column.iter().all(|value| value.is_nan()));
            let sorted = |column: Vec<f64>| in_time.iter().map(|&row| column[row]).collect();
            streams.entry(id).or_default().push(Stream {
                name: name.clone(),
                t_s: in_time.iter().map(since_s).collect(),
                columns: there.map(|(role, column)| (role, sorted(column))).collect(),
            });
        }
        streams
    }
}

/// One row on its way.
struct Row<'b> {
    values: Vec<f64>,
    stamp_ns: Option<i64>,
    name: Option<&'b str>,
    frame: &'b str,
    child: &'b str,
}

impl<'b> Row<'b> {
    fn new(width: usize) -> Row<'b> {
        Row {
            values: vec![f64::NAN; width],
            stamp_ns: None,
            name: None,
            frame: "",
            child: "",
        }
    }

    /// Turns its velocity out of the body; says whether it has one.
    fn turn_velocity(&mut self, roles: &[Role]) -> bool {
        let place = |role| roles.iter().position(|of| *of == role);
        let of = |role| place(role).map(|at| self.values[at]);
        let (Some(x), Some(y), Some(z), Some(w)) = (
            of(Role::Quaternion(0)),
            of(Role::Quaternion(1)),
            of(Role::Quaternion(2)),
            of(Role::Quaternion(3)),
        ) else {
            return false;
        };
        let (Some(vx), Some(vy), Some(vz)) = (
            of(Role::Velocity(0)),
            of(Role::Velocity(1)),
            of(Role::Velocity(2)),
        ) else {
            return false;
        };
        let attitude = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let turned = attitude * Vector3::new(vx, vy, vz);
        for (axis, value) in turned.iter().enumerate() {
            if let Some(at) = place(Role::Velocity(axis)) {
                self.values[at] = *value;
            }
        }
        true
    }
}

fn said(error: McapError) -> String {
    match error {
        McapError::UnexpectedEof => "it ends within a record".to_owned(),
        other => other.to_string(),
    }
}

/// The records of a chunk, whose checksum is right.
fn unpacked(header: &ChunkHeader, packed: &[u8]) -> Result<Vec<u8>, String> {
    let length = usize::try_from(header.uncompressed_size).ok();
    let Some(length) = length.filter(|length| *length <= LONGEST) else {
        let bytes = header.uncompressed_size;
        return Err(format!("a chunk of {bytes} bytes, more than {LONGEST}"));
    };
    let mut unpacked = Vec::new();
    let most = length as u64 + 1;
    let read = match header.compression.as_str() {
        "" => {
            unpacked.extend(packed);
            Ok(0)
        }
        "zstd" => match ruzstd::decoding::StreamingDecoder::new(packed) {
            Ok(decoder) => decoder.take(most).read_to_end(&mut unpacked),
            Err(error) => return Err(format!("a chunk cannot be unpacked: {error}")),
        },
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed)
            .take(most)
            .read_to_end(&mut unpacked),
        other => {
            return Err(format!(
                "a chunk is packed with `{other}`; known are zstd and lz4"
            ));
        }
    };
    read.map_err(|error| format!("a chunk cannot be unpacked: {error}"))?;
    if unpacked.len() != length {
        return Err(format!(
            "a chunk has {} bytes where it says {length}",
            unpacked.len()
        ));
    }
    let stated = header.uncompressed_crc;
    match stated == 0 || stated == crc32fast::hash(&unpacked) {
        true => Ok(unpacked),
        false => Err("the checksum of a chunk is wrong".to_owned()),
    }
}

#[cfg(test)]
mod tests;
