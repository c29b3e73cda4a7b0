//! One drone alone against its own earlier flights: has a weight or a propeller changed?
//!
//! In steady hover each motor is given the voltage that its share of the weight takes. Its
//! logarithm over that of normal flights, `e_m`, is parted into four modes, motors numbered around
//! the frame, neighbours turning in opposite senses:
//!
//! ```text
//! total (e1+e2+e3+e4)/4     turn (e1-e2+e3-e4)/4     lean (e3-e1)/2, (e4-e2)/2
//! ```
//!
//! - **payload_mass**: all work harder, those near it most. A weight under a motor needs `(-1, 1,
//!   3, 1)` quarters of it, so it leans at most twice as far as it is heavy, and does not turn:
//!   torque goes with thrust.
//! - **damaged_propeller**: one motor works harder, `e_k`: total and turn are a quarter of it, the
//!   lean half. A shorter blade also takes less torque for its thrust (`Q/T` goes with the
//!   diameter), and the others make up for it: the turn is larger by up to as much again.
//!
//! So the turn alone distinguishes them, and of two neighbouring propellers it cancels: then only
//! the set is reported. A weight that stands in a propeller's wash takes its thrust too, and reads
//! as a damaged propeller; no steady duty cycle can show that.
//!
//! Motors age, and hardware is taken apart and put together: a flight is compared with the normal
//! flights of its own session, and changes between sessions are reported separately.

use std::fmt;

use serde::Serialize;

use crate::record::recording::Recording;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Vertical speed (m/s) and departure of the specific force from gravity (parts) up to which a
/// drone counts as hovering. Chosen here.
const STEADY_MPS: f64 = 0.1;
const STEADY_FORCE: f64 = 0.1;
/// Height (m) above which it does: out of ground effect.
const ABOVE_FLOOR_M: f64 = 0.4;
/// Steady rows below which nothing is said: two seconds at 50 Hz.
const LEAST_ROWS: usize = 100;
/// p-value below which a flight is not normal. Chosen here: one normal flight in twenty is accused.
/// With a handful of normal flights to compare with, less asks for changes of more than five of
/// their standard deviations.
pub const LEAST_P: f64 = 0.05;
/// p-value below which what an answer leaves is no scatter, and the answer none. As of
/// [`LEAST_P`]: one answer in twenty that is right is refused.
const LEAST_FIT_P: f64 = LEAST_P;
/// How far a weight may lean for its total: two under a motor, a fifth more where it hangs outside.
const MOST_LEAN: f64 = 2.4;
/// Most extra turn of a damaged propeller, as part of its own.
const MOST_EXTRA_TURN: f64 = 1.0;
/// Normal flights of a drone within a session below which the report says that they are few: with
/// four of one drone alone a change of 6 of their standard deviations is seen, with two one of 62
/// (Student's t of three and one degrees of freedom at a p-value of 0.05 over four modes and two
/// sides, the scatter of the mean included).
pub const LEAST_NORMAL: usize = 4;
/// Answers within this of the best, in units of twice the log density, are reported too.
const TIE: f64 = 4.0;

/// What each motor is given in steady hover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// Mean of duty cycle times battery voltage of each motor (V).
    pub volts: [f64; 4],
    /// Steady rows.
    pub rows: usize,
}

impl Effort {
    /// Of the first vehicle of a recording; `None` without duty cycles or battery, or with too
    /// little steady hover.
    #[must_use]
    pub fn of(recording: &Recording) -> Option<Effort> {
        let track = &recording.vehicles.first()?.track;
        let (duty, battery_v) = (track.duty.as_ref()?, track.battery_v.as_ref()?);
        let floor_z_m = recording.environment.floor_z_m.unwrap_or(0.0);
        let gravity = recording.environment.gravity_mps2;
        let force = track.specific_force_mps2.as_ref();
        let steady = |row: &usize| {
            let height_m = track.position_m[*row].z - floor_z_m;
            let is_even = force.is_none_or(|f| (f[*row].z / gravity - 1.0).abs() < STEADY_FORCE);
            height_m > ABOVE_FLOOR_M
                && track.velocity_mps[*row].z.abs() < STEADY_MPS
                && is_even
                && !track.is_idle(*row)
                && battery_v[*row].is_finite()
                && duty[*row].iter().all(|duty| duty.is_finite())
        };
        let rows: Vec<usize> = (0..duty.len()).filter(steady).collect();
        if rows.len() < LEAST_ROWS {
            return None;
        }
        let mean = |motor: usize| {
            let volts = rows.iter().map(|&row| duty[row][motor] * battery_v[row]);
            volts.sum::<f64>() / rows.len() as f64
        };
        Some(Effort {
            volts: [0, 1, 2, 3].map(mean),
            rows: rows.len(),
        })
    }
}

/// The distribution of normal flights of some drones.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// Standard deviations of a flight's total, turn and leans, over all drones.
    pub scatter: [f64; 4],
    /// Degrees of freedom behind them.
    pub freedom: f64,
}

/// One answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// `payload_mass` or `damaged_propeller`.
    pub name: String,
    /// Motors concerned, from 1; of a weight, the one or two nearest to it.
    pub motors: Vec<usize>,
    /// Of a weight: whether it is one that has been taken off.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_lighter: bool,
    /// Squared distance that is left, in standard deviations, with two for every number fitted.
    pub cost: f64,
}

/// What motors are given in some flights over what they are given in others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Of each motor's voltage (logarithm).
    pub motors: [f64; 4],
    /// The same by modes: total, turn, and the two leans.
    pub modes: [f64; 4],
    /// p-value: how often normal flights are that far apart in any mode.
    #[serde(rename = "chance")]
    pub p_value: f64,
}

impl Change {
    /// Whether normal flights are rarely that far apart.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.p_value < LEAST_P
    }
}

/// What one flight says about the hardware.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HardwareFinding {
    /// Over normal flights.
    #[serde(flatten)]
    pub change: Change,
    /// Empty: normal, or, where a change is seen, one that neither a weight nor a propeller
    /// explains. Else best first; more than one: it cannot tell.
    pub answers: Vec<Answer>,
}

/// `damaged_propeller M1 and M2`, `payload_mass near M3`.
impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let motors: Vec<String> = self.motors.iter().map(|at| format!("M{at}")).collect();
        let motors = motors.join(" and ");
        let less = if self.is_lighter { " (lighter)" } else { "" };
        match (self.name.as_str(), motors.is_empty()) {
            ("payload_mass", true) => write!(f, "payload_mass{less} in the middle"),
            ("payload_mass", false) => write!(f, "payload_mass{less} near {motors}"),
            (name, _) => write!(f, "{name} {motors}"),
        }
    }
}

/// Every answer, joined by `or`.
impl fmt::Display for HardwareFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let answers: Vec<String> = self.answers.iter().map(ToString::to_string).collect();
        match (answers.is_empty(), self.change.is_seen()) {
            (true, false) => f.write_str("nothing beyond the scatter of normal flights"),
            (true, true) => f.write_str(
                "changed, and neither a weight nor one or two damaged propellers explain it",
            ),
            (false, _) => f.write_str(&answers.join(", or ")),
        }
    }
}

/// Modes of four values.
#[must_use]
pub fn modes([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [
        0.25 * (a + b + c + d),
        0.25 * (a - b + c - d),
        0.5 * (c - a),
        0.5 * (d - b),
    ]
}

/// Mean change of each motor's voltage in some flights over others (logarithm).
fn logarithms(these: &[Effort], over: &[Effort]) -> [f64; 4] {
    let mean = |flights: &[Effort], motor: usize| {
        let logarithms = flights.iter().map(|one| one.volts[motor].ln());
        logarithms.sum::<f64>() / flights.len() as f64
    };
    [0, 1, 2, 3].map(|motor| mean(these, motor) - mean(over, motor))
}

impl Normal {
    /// From the normal flights of each drone within each session; `None` where none has two, or no
    /// two differ.
    #[must_use]
    pub fn of(groups: &[Vec<Effort>]) -> Option<Normal> {
        let mut squares = [0.0; 4];
        let mut freedom = 0.0;
        for flights in groups.iter().filter(|flights| flights.len() > 1) {
            for flight in flights {
                let modes = modes(logarithms(std::slice::from_ref(flight), flights));
                squares = [0, 1, 2, 3].map(|at| squares[at] + modes[at] * modes[at]);
            }
            freedom += flights.len() as f64 - 1.0;
        }
        if freedom < 1.0 {
            return None;
        }
        let [total, turn, lean, other] = squares.map(|square| (square / freedom).sqrt());
        // The frame is symmetric: both leans scatter alike.
        let lean = (0.5 * (lean * lean + other * other)).sqrt();
        let scatter = [total, turn, lean, lean];
        (scatter.iter().all(|sd| *sd > 0.0)).then_some(Normal { scatter, freedom })
    }

    /// By how much the mean of some flights of a drone may differ from that of others, in each
    /// mode: both scatter.
    fn scatter_between(&self, these: usize, those: usize) -> [f64; 4] {
        let both = (1.0 / these.max(1) as f64 + 1.0 / those.max(1) as f64).sqrt();
        self.scatter.map(|sd| both * sd)
    }

    /// Some flights of a drone over others; at least one of each.
    #[must_use]
    pub fn compare(&self, these: &[Effort], those: &[Effort]) -> Change {
        let motors = logarithms(these, those);
        let modes = modes(motors);
        let sd = self.scatter_between(these.len(), those.len());
        let farthest = modes.iter().zip(sd).map(|(m, sd)| (m / sd).abs());
        let farthest = farthest.fold(0.0, f64::max);
        let p_value = StudentsT::new(0.0, 1.0, self.freedom)
            .map_or(1.0, |t| (4.0 * 2.0 * t.sf(farthest)).min(1.0));
        Change {
            motors,
            modes,
            p_value,
        }
    }

    /// Judges a flight against normal flights of the same drone, of which there is at least one.
    #[must_use]
    pub fn judge(&self, flight: &Effort, normal: &[Effort]) -> HardwareFinding {
        let change = self.compare(std::slice::from_ref(flight), normal);
        let sd = self.scatter_between(1, normal.len());
        let answers = match change.is_seen() {
            true => answers(change.modes, sd, self.freedom),
            false => Vec::new(),
        };
        HardwareFinding { change, answers }
    }
}

/// A flight, and what is stated of it.
#[derive(Clone, Copy, Debug)]
pub struct StatedFlight<'a> {
    /// Name of the recording.
    pub name: &'a str,
    /// What its motors are given; `None` without enough steady hover.
    pub effort: Option<Effort>,
    /// Which drone flew.
    pub drone: &'a str,
    /// In which session: motors are compared within one.
    pub session: &'a str,
    /// Whether it flew the hardware as stated.
    pub is_normal: bool,
}

/// Hardware of one flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HardwareRow {
    /// Name of the recording.
    pub flight: String,
    /// Whether it is one of the normal flights; it was then left out of what it is compared with.
    pub is_normal: bool,
    /// Normal flights of its drone and session that it is compared with.
    pub compared_with: usize,
    /// What it says.
    #[serde(flatten)]
    pub found: HardwareFinding,
}

/// The normal flights of one drone within one session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionRow {
    /// Which drone flew.
    pub drone: String,
    /// In which session.
    pub session: String,
    /// How many with enough steady hover.
    pub normal_flights: usize,
    /// Over the drone's first session that has normal flights; `None`: this one is it.
    pub drift: Option<Change>,
}

impl SessionRow {
    /// Whether there are fewer normal flights than [`LEAST_NORMAL`].
    #[must_use]
    pub fn has_few(&self) -> bool {
        self.normal_flights < LEAST_NORMAL
    }
}

/// What the motors of some flights say.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hardware {
    /// Every flight that can be compared.
    pub flights: Vec<HardwareRow>,
    /// Every drone's sessions, in the order in which their flights are given.
    pub sessions: Vec<SessionRow>,
    /// Names of flights without enough steady hover, duty cycles or battery voltages.
    pub without_hover: Vec<String>,
    /// Names of flights of a drone that has no other normal flight in the session, or none whose
    /// scatter is known.
    pub without_normal: Vec<String>,
}

/// Every flight against the normal flights of the same drone in the same session. A normal flight
/// is compared with the others, and left out of the scatter too.
#[must_use]
pub fn hardware(flights: &[StatedFlight<'_>]) -> Hardware {
    let mut groups: Vec<(&str, &str)> = Vec::new();
    for flight in flights {
        if !groups.contains(&(flight.drone, flight.session)) {
            groups.push((flight.drone, flight.session));
        }
    }
    let normal_of = |group: (&str, &str), but: Option<usize>| -> Vec<Effort> {
        (0..flights.len())
            .filter(|&i| Some(i) != but && flights[i].is_normal)
            .filter(|&i| (flights[i].drone, flights[i].session) == group)
            .filter_map(|i| flights[i].effort)
            .collect()
    };
    let normal_but = |but: Option<usize>| {
        let groups: Vec<_> = groups.iter().map(|group| normal_of(*group, but)).collect();
        Normal::of(&groups)
    };
    let mut all = Hardware::default();
    for (index, flight) in flights.iter().enumerate() {
        let name = flight.name.to_owned();
        let Some(effort) = flight.effort else {
            all.without_hover.push(name);
            continue;
        };
        let own = normal_of((flight.drone, flight.session), Some(index));
        match normal_but(Some(index)).filter(|_| !own.is_empty()) {
            Some(normal) => all.flights.push(HardwareRow {
                flight: name,
                is_normal: flight.is_normal,
                compared_with: own.len(),
                found: normal.judge(&effort, &own),
            }),
            None => all.without_normal.push(name),
        }
    }
    let normal = normal_but(None);
    for group in &groups {
        let own = normal_of(*group, None);
        let of_drone = groups.iter().filter(|(drone, _)| *drone == group.0);
        let first = of_drone.map(|it| (it, normal_of(*it, None)));
        let first = first.into_iter().find(|(_, flights)| !flights.is_empty());
        let before = first.filter(|(it, _)| *it != group && !own.is_empty());
        let drift = before.zip(normal.as_ref());
        all.sessions.push(SessionRow {
            drone: group.0.to_owned(),
            session: group.1.to_owned(),
            normal_flights: own.len(),
            drift: drift.map(|((_, before), normal)| normal.compare(&own, &before)),
        });
    }
    all
}

/// What explains the modes, best first, with everything that does as well; `freedom` is that of the
/// scatter. Empty where the best leaves more than scatter.
fn answers(modes: [f64; 4], sd: [f64; 4], freedom: f64) -> Vec<Answer> {
    let mut all: Vec<(Answer, f64)> = payload(modes, sd).into_iter().collect();
    for a in 0..4 {
        all.extend(propellers(modes, sd, &[a]));
        all.extend((a + 1..4).filter_map(|b| propellers(modes, sd, &[a, b])));
    }
    all.sort_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
    let is_scatter = |(best, fitted): &(Answer, f64)| {
        // Four modes, less what was fitted: a ratio of two variances.
        let left = modes.len() as f64 - fitted;
        let ratio = (best.cost - 2.0 * fitted) / left;
        FisherSnedecor::new(left, freedom).is_ok_and(|law| law.sf(ratio) >= LEAST_FIT_P)
    };
    if !all.first().is_some_and(is_scatter) {
        return Vec::new();
    }
    let mut all: Vec<Answer> = all.into_iter().map(|(answer, _)| answer).collect();
    let best = all[0].cost;
    all.retain(|answer| answer.cost < best + TIE);
    // A second damaged propeller beside one that does alone is no other answer.
    let is_payload = |answer: &Answer| answer.name == "payload_mass";
    let is_one = |answer: &Answer| !is_payload(answer) && answer.motors.len() == 1;
    let alone = all.iter().filter(|answer| is_one(answer));
    let alone: Vec<usize> = alone.map(|answer| answer.motors[0]).collect();
    let is_beside = |answer: &Answer| answer.motors.iter().any(|motor| alone.contains(motor));
    all.retain(|answer| is_payload(answer) || is_one(answer) || !is_beside(answer));
    // Something fastened under a motor stands in its wash: it takes that propeller's thrust as a
    // cut would.
    if is_one(&all[0]) && !all.iter().any(is_payload) {
        let under = Answer {
            name: "payload_mass".into(),
            ..all[0].clone()
        };
        all.insert(1, under);
    }
    all
}

fn distance(modes: [f64; 4], model: [f64; 4], sd: [f64; 4]) -> f64 {
    let apart = modes.iter().zip(model).zip(sd);
    apart.map(|((m, f), sd)| ((m - f) / sd).powi(2)).sum()
}

/// Numbers that a weight is fitted by: its total and its place.
const OF_A_WEIGHT: f64 = 3.0;

/// A weight somewhere on the frame, or one taken off, and how many numbers were fitted; `None`
/// where none fits best.
fn payload(modes: [f64; 4], sd: [f64; 4]) -> Option<(Answer, f64)> {
    let [_, _, lean_a, lean_b] = modes;
    let size = lean_a.hypot(lean_b);
    // Totals up to 0.3 either way: a weight of more than half the drone, or a drone of half of its.
    let fits = (-600..=600).map(|i| {
        let total = 5e-4 * f64::from(i);
        // Without a lean the share of it does not matter.
        let share = (MOST_LEAN * total.abs() / size.max(f64::MIN_POSITIVE)).min(1.0);
        let model = [total, 0.0, share * lean_a, share * lean_b];
        (total, distance(modes, model, sd))
    });
    let (total, least) = fits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    // It leans towards one motor, or between two; a motor's direction counts within 30 degrees. One
    // that is taken off leans away from where it was.
    let side = total.signum();
    let towards = [-lean_a, -lean_b, lean_a, lean_b].map(|of| side * of);
    let motors = (0..4).filter(|&m| towards[m] > 0.5 * size && size > MOST_LEAN * 0.1 * sd[2]);
    let answer = Answer {
        name: "payload_mass".into(),
        motors: motors.map(|m| m + 1).collect(),
        is_lighter: total < 0.0,
        cost: least + 2.0 * OF_A_WEIGHT,
    };
    (total != 0.0).then_some((answer, OF_A_WEIGHT))
}

/// One or two propellers that give less thrust, and how many numbers were fitted; `None` where one
/// of them fits best undamaged.
fn propellers(modes: [f64; 4], sd: [f64; 4], which: &[usize]) -> Option<(Answer, f64)> {
    let sizes = || (0..=80).map(|i| 5e-3 * f64::from(i));
    let cost = |a: f64, b: f64| {
        let mut strengths = [0.0; 4];
        strengths[which[0]] = a;
        if let Some(&second) = which.get(1) {
            strengths[second] = b;
        }
        let own = self::modes(strengths);
        // The extra turn is shared by all damaged ones, in the sense in which each turns.
        let with = |extra| [own[0], own[1] * (1.0 + extra), own[2], own[3]];
        let costs = [0.0, 0.5, MOST_EXTRA_TURN].map(|extra| distance(modes, with(extra), sd));
        costs.into_iter().fold(f64::INFINITY, f64::min)
    };
    let is_pair = which.len() > 1;
    let seconds = || sizes().take(if is_pair { usize::MAX } else { 1 });
    let fits = sizes().flat_map(|a| seconds().map(move |b| (a, b)));
    let fits = fits.map(|(a, b)| (a, b, cost(a, b)));
    let (a, b, least) = fits.min_by(|one, other| one.2.total_cmp(&other.2))?;
    // The extra turn is bounded: half a number.
    let fitted = which.len() as f64 + 0.5;
    let answer = Answer {
        name: "damaged_propeller".into(),
        motors: which.iter().map(|m| m + 1).collect(),
        is_lighter: false,
        cost: least + 2.0 * fitted,
    };
    (a > 0.0 && (b > 0.0 || !is_pair)).then_some((answer, fitted))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effort(changes: [f64; 4]) -> Effort {
        Effort {
            volts: changes.map(|change| 2.5 * f64::exp(change)),
            rows: 500,
        }
    }

    fn normal() -> (Normal, Vec<Effort>) {
        let flights = vec![
            effort([0.004, -0.001, 0.001, -0.003]),
            effort([-0.003, 0.003, -0.002, 0.002]),
            effort([0.002, 0.002, 0.004, -0.001]),
            effort([-0.003, -0.003, -0.003, 0.002]),
        ];
        (
            Normal::of(std::slice::from_ref(&flights)).expect("four flights"),
            flights,
        )
    }

    #[test]
    fn one_motor_that_works_harder_alone_has_a_damaged_propeller_or_something_in_its_wash() {
        let (normal, flights) = normal();
        let found = normal.judge(&effort([0.0, 0.0, 0.1, 0.0]), &flights);
        assert_eq!(found.answers[0].name, "damaged_propeller");
        assert_eq!(found.answers[0].motors, [3]);
        assert!(
            found
                .answers
                .iter()
                .any(|answer| answer.name == "payload_mass")
        );
    }

    #[test]
    fn a_weight_under_a_motor_does_not_turn_and_is_named() {
        let (normal, flights) = normal();
        let found = normal.judge(&effort([-0.02, 0.02, 0.06, 0.02]), &flights);
        assert_eq!(found.answers[0].name, "payload_mass");
        assert_eq!(found.answers[0].motors, [3]);
    }

    #[test]
    fn a_normal_flight_is_not_accused() {
        let (normal, flights) = normal();
        assert!(
            normal
                .judge(&effort([0.002, -0.002, 0.003, 0.0]), &flights)
                .answers
                .is_empty()
        );
    }

    #[test]
    fn a_drone_that_is_lighter_has_lost_a_weight_and_no_propeller() {
        let (normal, flights) = normal();
        let found = normal.judge(&effort([-0.1; 4]), &flights);
        let [answer] = &found.answers[..] else {
            panic!("{found}");
        };
        assert!(answer.is_lighter && answer.motors.is_empty(), "{answer}");
        let under = [0.02, -0.02, -0.06, -0.02].map(|change| 2.0 * change);
        let found = normal.judge(&effort(under), &flights);
        assert_eq!(
            found.answers[0].to_string(),
            "payload_mass (lighter) near M3"
        );
    }

    #[test]
    fn what_neither_a_weight_nor_a_propeller_explains_accuses_none() {
        let (normal, flights) = normal();
        for changes in [[-0.15, 0.0, 0.0, 0.0], [-0.12, 0.0, -0.12, 0.0]] {
            let found = normal.judge(&effort(changes), &flights);
            assert!(found.answers.is_empty(), "{changes:?}: {found}");
            assert!(found.change.is_seen() && found.to_string().starts_with("changed"));
        }
    }

    #[test]
    fn a_motor_that_changed_between_sessions_is_told_of_them_and_of_no_flight() {
        let scatter = normal().1;
        let changed = scatter.iter().map(|flight| Effort {
            volts: [0, 1, 2, 3].map(|m| flight.volts[m] * if m == 2 { 1.08 } else { 1.0 }),
            ..*flight
        });
        let flights = |sessions: [&'static str; 2]| -> Vec<StatedFlight<'static>> {
            let of = |session| {
                move |effort: Effort| StatedFlight {
                    name: "normal",
                    effort: Some(effort),
                    drone: "E8",
                    session,
                    is_normal: true,
                }
            };
            let before = scatter.iter().copied().map(of(sessions[0]));
            before.chain(changed.clone().map(of(sessions[1]))).collect()
        };
        let apart = hardware(&flights(["monday", "friday"]));
        assert_eq!(apart.flights.len(), 8);
        assert!(apart.flights.iter().all(|row| row.found.answers.is_empty()));
        let [monday, friday] = &apart.sessions[..] else {
            panic!("two sessions: {:?}", apart.sessions);
        };
        assert_eq!((monday.normal_flights, monday.drift), (4, None));
        let drift = friday.drift.expect("over monday");
        assert!(
            drift.is_seen() && (drift.motors[2] - f64::ln(1.08)).abs() < 1e-9,
            "{drift:?}"
        );

        let few = hardware(&flights(["monday", "friday"])[2..6]);
        assert!(few.sessions.iter().all(SessionRow::has_few));
        let one = hardware(&flights(["monday", "friday"])[3..]);
        assert_eq!(one.without_normal, ["normal"]);
    }
}
