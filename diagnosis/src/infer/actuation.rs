//! What the drones' own throttle and power say about mass and density, before any air is judged.
//!
//! ```text
//! throttle t ~ √(m/ρ),  power p ~ m^1.5 ρ^-0.5   =>   m = p/t,  ρ = m/t²        each over what the metadata give
//! ```
//!
//! Speeds alone cannot tell a heavier drone from thinner air or from a probe that reads too much;
//! this can, and it reveals pairs that cancel one another in the speeds.

use std::fmt;

use airflow::effects::EffectSpec;

use crate::forward::flow::Flow;
use crate::forward::hypothesis::Hypothesis;
use crate::forward::receiver;
use crate::infer::intervals::NINETY_FIVE;
use crate::record::recording::{Recording, Role, Vehicle};
use crate::record::remark::{Remark, RemarkKind};
use crate::statistics::change_point;
use crate::statistics::quantile::mean;

/// Departure of the throttle from hover that counts. A hover's mean throttle is known to less than
/// a percent.
const LEAST: f64 = 0.025;
/// Share of the electrical power that ends as the induced power of momentum theory, and between
/// what it may be. Assumed here, because figures of merit and motor efficiencies of small electric
/// quadrotors multiply to 0.5 to 0.7; it matters only where a mass is told from a density, and no
/// power refutes either that another share would explain.
const EFFICIENCY: f64 = 0.6;
const EFFICIENCIES: [f64; 2] = [0.5, 0.7];

/// How many entries the moment of a step may be off. Chosen here: a throttle settles in one or two.
const CHANGE_WITHIN: f64 = 2.0;

/// A cause in the drones: more or less mass or density than stated.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Its name in the effect table: `payload_mass` or `air_density`.
    pub effect: &'static str,
    /// Values of its parameters: the factor (1), and of a payload the moments from which and until
    /// which it is carried (s); infinite: always.
    pub values: Vec<f64>,
    /// Half-widths of their 95 % intervals, in their units; of a moment how far off it may be.
    pub half_widths: Vec<f64>,
    /// The other of the two, where what is logged says either.
    pub alternative: Option<&'static str>,
}

impl Cause {
    fn payload(mass_factor: f64, error: f64, [since_s, until_s]: [f64; 2], within_s: f64) -> Cause {
        Cause {
            effect: "payload_mass",
            values: vec![mass_factor, since_s, until_s],
            half_widths: vec![NINETY_FIVE * error, within_s, within_s],
            alternative: None,
        }
    }

    /// Its row of the effect table.
    pub(crate) fn spec(&self) -> &'static EffectSpec {
        EffectSpec::named(self.effect).expect("both are rows of the effect table")
    }

    /// Whether its values are such as a finding may hold.
    fn is_possible(&self) -> bool {
        let components = self.spec().components().zip(&self.values);
        let mut ranges = components.map(|((of, _), value)| (of.range, value));
        ranges.all(|([low, high], value)| (low..=high).contains(value))
    }

    /// Whether another is the same within what counts: throttles go with the root of a mass.
    fn is_nearly(&self, other: &Cause) -> bool {
        let within_s = self.half_widths.last().copied().unwrap_or(0.0);
        let off = |at: usize| match self.values[at] == other.values[at] {
            true => 0.0,
            false => (self.values[at] - other.values[at]).abs(),
        };
        off(0) < 2.0 * LEAST && off(1).max(off(2)) <= within_s
    }

    /// Puts it into a hypothesis.
    pub fn set(&self, hypothesis: &mut Hypothesis) {
        self.spec().set(&mut hypothesis.effects, &self.values);
    }
}

/// What throttle and power say of mass and density.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Actuation {
    /// What all emitters have in common.
    pub cause: Option<Cause>,
    /// Whether powers confirm it: one that throttles alone tell of may be a column that reads
    /// wrong.
    pub is_confirmed: bool,
    /// A mass of its own that a receiver has when it is in no wake, of the first that has one.
    pub receiver_load: Option<Cause>,
    /// Whether emitters depart from what is stated, and no cause says how.
    pub is_contradicted: bool,
    /// What of them no such cause explains, and receivers with a mass of their own.
    pub remarks: Vec<Remark>,
}

/// `a mass of 1.300 of the stated from 300 s on`.
impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.effect {
            "payload_mass" => "mass",
            _ => "density",
        };
        write!(f, "a {what} of {:.3} of the stated", self.values[0])?;
        if let Some(since_s) = self.values.get(1).filter(|since_s| since_s.is_finite()) {
            write!(f, " from {since_s:.0} s on")?;
        }
        match self.values.get(2).filter(|until_s| until_s.is_finite()) {
            Some(until_s) => write!(f, " until {until_s:.0} s"),
            None => Ok(()),
        }
    }
}

/// A drone in the air: rotors that idle say nothing of its mass.
struct AirborneDrone<'r> {
    vehicle: &'r Vehicle,
    t_s: Vec<f64>,
    /// Over hover's.
    throttle: Vec<f64>,
    /// Over hover's.
    power: Option<Vec<f64>>,
}

impl AirborneDrone<'_> {
    /// In the entries at times that count; `None` where no throttle is logged, or none is left.
    fn of<'r>(
        recording: &Recording,
        vehicle: &'r Vehicle,
        counts: impl Fn(f64) -> bool,
    ) -> Option<AirborneDrone<'r>> {
        let track = &vehicle.track;
        let throttle = track.throttle_ratio.as_ref()?;
        let is_flown = |entry: &usize| !track.is_idle(*entry) && counts(track.t_s[*entry]);
        let entries: Vec<usize> = (0..throttle.len()).filter(is_flown).collect();
        let of = |column: &Vec<f64>| -> Vec<f64> { entries.iter().map(|&i| column[i]).collect() };
        let density = recording.environment.air.density_kg_per_m3();
        let airframe = &vehicle.airframe;
        let hover_w = airframe.hover_power_w(airframe.mass_kg(), density) / EFFICIENCY;
        let over_hover = |column| of(column).into_iter().map(|power_w| power_w / hover_w);
        (!entries.is_empty()).then(|| AirborneDrone {
            vehicle,
            t_s: of(&track.t_s),
            throttle: of(throttle),
            power: track
                .power_w
                .as_ref()
                .map(|column| over_hover(column).collect()),
        })
    }

    fn mean_throttle(&self) -> f64 {
        mean(&self.throttle)
    }

    /// What it says by itself; in words where that is neither a mass nor a density.
    fn cause(&self) -> Result<Option<Cause>, String> {
        step(self).unwrap_or_else(|| {
            let power = self.power.as_ref().map(|power| mean(power));
            always(self, self.mean_throttle(), power)
        })
    }

    /// Relative errors of means: of a mass or a density that throttle and power agree about.
    fn error(&self) -> f64 {
        let relative = |of: &Vec<f64>| standard_error(of) / mean(of);
        (3.0 * relative(&self.throttle)).hypot(self.power.as_ref().map_or(0.0, relative))
    }

    /// A departure of its own, in words.
    fn departure(&self) -> Option<String> {
        let cause = match self.cause() {
            Ok(cause) => cause?,
            Err(why) => return Some(why),
        };
        let throttle = self.mean_throttle();
        let power = self.power.iter();
        let power = power.map(|power| format!(", power {:.3}", mean(power)));
        let power: String = power.collect();
        Some(format!(
            "throttle {throttle:.3} of hover's in the mean{power}: {cause}"
        ))
    }
}

fn emitters(recording: &Recording) -> impl Iterator<Item = &Vehicle> {
    let vehicles = recording.vehicles.iter();
    vehicles.filter(|vehicle| vehicle.role == Role::Emitter)
}

/// Whether any emitter's throttle is logged.
#[must_use]
pub fn is_logged(recording: &Recording) -> bool {
    emitters(recording).any(|vehicle| vehicle.track.throttle_ratio.is_some())
}

/// What throttle and power say. There is no cause where no throttle is logged, nothing departs from
/// what is stated, or as much as no drone could; where emitters disagree; or where a throttle and
/// a power contradict each other.
#[must_use]
pub fn actuation(recording: &Recording) -> Actuation {
    let mut said = Actuation::default();
    let flown = emitters(recording).filter_map(|one| AirborneDrone::of(recording, one, |_| true));
    let flown: Vec<AirborneDrone> = flown.collect();
    let remark = |drone: &AirborneDrone, message: String| {
        Remark::new(RemarkKind::Contradicted, Some(&drone.vehicle.id), message)
    };
    match common(&flown) {
        Some(Ok(cause)) => {
            said.is_confirmed = flown.iter().all(|one| one.power.is_some());
            said.cause = cause.filter(Cause::is_possible);
        }
        Some(Err(why)) => said.remarks.push(remark(&flown[0], why)),
        None => {
            let own = flown.iter().filter_map(|one| Some((one, one.departure()?)));
            said.remarks.extend(own.map(|(one, departure)| {
                remark(one, format!("{departure}; other drones say otherwise, so nothing is taken as common to all"))
            }));
        }
    }
    said.is_contradicted = !said.remarks.is_empty();
    let flow = Flow::new(recording);
    for (index, vehicle) in recording.vehicles.iter().enumerate() {
        if vehicle.role != Role::Receiver || vehicle.track.power_w.is_none() {
            continue;
        }
        let is_still = |t_s| receiver::is_still(&flow, index, t_s) == Some(true);
        let Some(drone) = AirborneDrone::of(recording, vehicle, is_still) else {
            continue;
        };
        let own = drone.cause().ok().flatten().filter(Cause::is_possible);
        let Some(load) = own.filter(|own| own.effect == "payload_mass") else {
            continue;
        };
        let message = format!(
            "out of all wakes its throttle and its power say {load}, which readings of throttle alone cannot tell from an instrument's gain or offset"
        );
        said.remarks.push(remark(&drone, message));
        said.receiver_load = said.receiver_load.or(Some(load));
    }
    said
}

/// What several drones have in common; `None` where they disagree.
fn common(flown: &[AirborneDrone]) -> Option<Result<Option<Cause>, String>> {
    let Some(first) = flown.first() else {
        return Some(Ok(None));
    };
    if flown.len() == 1 {
        return Some(first.cause());
    }
    let throttles: Vec<f64> = flown.iter().map(AirborneDrone::mean_throttle).collect();
    let is_alike = throttles.iter().all(|t| (t - throttles[0]).abs() < LEAST);
    if !is_alike {
        return None;
    }
    let steps: Vec<Option<_>> = flown.iter().map(step).collect();
    if steps.iter().all(Option::is_none) {
        let powers = flown.iter().filter_map(|one| one.power.as_ref());
        let powers: Vec<f64> = powers.map(|power| mean(power)).collect();
        let power = (!powers.is_empty()).then(|| mean(&powers));
        return Some(always(first, mean(&throttles), power));
    }
    let mut loads = steps
        .into_iter()
        .map(|step| step.and_then(|it| it.ok().flatten()));
    let load = loads.next()??;
    let is_same = |other: Option<Cause>| other.is_some_and(|other| load.is_nearly(&other));
    loads.all(is_same).then_some(Ok(Some(load)))
}

/// A constant departure.
fn always(
    first: &AirborneDrone,
    throttle: f64,
    power: Option<f64>,
) -> Result<Option<Cause>, String> {
    if (throttle - 1.0).abs() < LEAST {
        return Ok(None);
    }
    let error = 2.0 * throttle * standard_error(&first.throttle);
    let square = throttle * throttle;
    let always_s = [f64::NEG_INFINITY, f64::INFINITY];
    let density = Cause {
        effect: "air_density",
        values: vec![square.recip()],
        half_widths: vec![NINETY_FIVE * error],
        alternative: None,
    };
    // Each with the power that goes with it, in the middle of what may move air.
    let [of_mass, of_density] = [throttle * square, throttle];
    let both = [
        (Cause::payload(square, error, always_s, 0.0), of_mass),
        (density, of_density),
    ];
    let least = LEAST + NINETY_FIVE * first.error();
    let [low, high] = EFFICIENCIES;
    // Without a power any share is as good.
    let share = |expected: f64| power.map_or(EFFICIENCY, |power| EFFICIENCY * expected / power);
    let is_allowed = |(_, expected): &(Cause, f64)| {
        (low * (1.0 - least)..=high * (1.0 + least)).contains(&share(*expected))
    };
    let mut allowed: Vec<(Cause, f64)> = both.into_iter().filter(is_allowed).collect();
    if allowed.is_empty() {
        let of = |expected: f64| [high, low].map(|share| EFFICIENCY / share * expected);
        let ([mass_low, mass_high], [density_low, density_high]) = (of(of_mass), of(of_density));
        return Err(format!(
            "throttle {throttle:.3} of hover's goes with a power of {mass_low:.3} to {mass_high:.3} for another mass and of {density_low:.3} to {density_high:.3} for another density, and {:.3} is logged: a column reads wrong, or another share of the power than {low} to {high} moves air; neither is named",
            power.unwrap_or(f64::NAN)
        ));
    }
    allowed.retain(|(cause, _)| cause.is_possible());
    let off = |expected: f64| (share(expected) / EFFICIENCY).ln().abs();
    allowed.sort_by(|(_, a), (_, b)| off(*a).total_cmp(&off(*b)));
    let mut causes = allowed.into_iter().map(|(cause, _)| cause);
    let cause = causes.next();
    let alternative = causes.next().map(|other| other.effect);
    Ok(cause.map(|cause| Cause {
        alternative,
        ..cause
    }))
}

/// A step from the stated mass to another, and back where there is a second one; `None` without.
fn step(flown: &AirborneDrone) -> Option<Result<Option<Cause>, String>> {
    let AirborneDrone { t_s, throttle, .. } = flown;
    let steps = change_point::steps(throttle);
    let first = steps.first()?;
    let end = steps.get(1).map_or(throttle.len(), |second| second.index);
    // The level that is nearer to hover is the stated mass.
    let starts_loaded = (first.before - 1.0).abs() > (first.after - 1.0).abs();
    let (loaded, unloaded, plain, since_s) = match first.index {
        to if starts_loaded => (0..to, to..end, first.after, f64::NEG_INFINITY),
        from => (from..end, 0..from, first.before, t_s[from]),
    };
    let until_s = t_s.get(loaded.end).copied().unwrap_or(f64::INFINITY);
    let step_s = (t_s[t_s.len() - 1] - t_s[0]) / t_s.len().max(2) as f64;
    let part = &throttle[loaded.clone()];
    let change = mean(part) / plain;
    let mass_factor = change.powi(2);
    if let Some(power) = &flown.power {
        let [of_loaded, of_unloaded] = [&power[loaded], &power[unloaded.clone()]];
        let of_power = mean(of_loaded) / mean(of_unloaded);
        let relative = |of: &[f64]| standard_error(of) / mean(of);
        let of_throttles = 3.0 * relative(part).hypot(relative(&throttle[unloaded]));
        let error = of_throttles.hypot(relative(of_loaded).hypot(relative(of_unloaded)));
        if (of_power / (change * mass_factor) - 1.0).abs() > LEAST + NINETY_FIVE * error {
            return Some(Err(format!(
                "throttle steps by a factor of {change:.3}, which goes with one of {:.3} of power for another mass, and power by {of_power:.3}: a column reads wrong; no mass is named",
                change * mass_factor
            )));
        }
    }
    let (error, within_s) = (2.0 * standard_error(part), CHANGE_WITHIN * step_s);
    let span_s = [since_s, until_s];
    Some(Ok(Some(Cause::payload(
        mass_factor,
        error,
        span_s,
        within_s,
    ))))
}

/// Standard error of the mean, neighbours taken as independent in tens.
fn standard_error(values: &[f64]) -> f64 {
    let middle = mean(values);
    let count = values.len().max(2) as f64;
    let squares = values.iter().map(|x| (x - middle) * (x - middle));
    (10.0 * squares.sum::<f64>() / (count - 1.0) / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::diagnose::tests::hall;

    #[test]
    fn rotors_that_idle_say_nothing_of_mass() {
        let mut recording = hall();
        let track = &mut recording.vehicles[0].track;
        // As stated, and idle for half of the time at first.
        let entries = track.t_s.len();
        let throttle = track.throttle_ratio.as_mut().expect("it is logged");
        throttle[..entries / 2].fill(0.0);
        assert_eq!(actuation(&recording).cause, None);
        // Three tenths more in the air, whatever stood on the floor.
        let throttle = recording.vehicles[0].track.throttle_ratio.as_mut();
        let flown = throttle.into_iter().flatten().filter(|ratio| **ratio > 0.0);
        flown.for_each(|ratio| *ratio *= 1.3_f64.sqrt());
        recording.vehicles[0].track.power_w = None;
        let found = actuation(&recording).cause.expect("it is heavier");
        assert_eq!(found.effect, "payload_mass");
        assert!((found.values[0] - 1.3).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn no_cause_is_named_that_a_finding_could_not_hold() {
        let mut recording = hall();
        let track = &mut recording.vehicles[0].track;
        track.power_w = None;
        // Above what idles; a drone of a sixth of its mass.
        let throttle = track.throttle_ratio.as_mut().expect("it is logged");
        throttle.iter_mut().for_each(|ratio| *ratio *= 0.4);
        assert_eq!(actuation(&recording).cause, None);
    }

    /// Throttle and power of a drone times these factors.
    fn work(vehicle: &mut Vehicle, throttle: f64, power: f64) {
        let columns = [
            &mut vehicle.track.throttle_ratio,
            &mut vehicle.track.power_w,
        ];
        for (column, factor) in columns.into_iter().zip([throttle, power]) {
            let column = column.as_mut().expect("it is logged");
            column.iter_mut().for_each(|value| *value *= factor);
        }
    }

    #[test]
    fn a_throttle_and_a_power_that_contradict_each_other_name_neither_mass_nor_density() {
        for (throttle, power, named) in [
            // Beyond what another share of the power that moves air would explain.
            (1.2, 0.9, None),
            (0.92, 1.3, None),
            (1.2, 1.2, Some("air_density")),
            (1.2, 1.2_f64.powi(3), Some("payload_mass")),
        ] {
            let mut recording = hall();
            work(&mut recording.vehicles[0], throttle, power);
            let said = actuation(&recording);
            assert_eq!(said.cause.as_ref().map(|of| of.effect), named, "{said:?}");
            assert_eq!(said.is_contradicted, named.is_none(), "{said:?}");
            let alternative = said.cause.and_then(|of| of.alternative);
            assert_eq!(alternative, None, "the other goes with another power");
        }
    }

    #[test]
    fn what_throttle_says_alone_or_with_any_power_that_may_move_air_is_a_mass_or_a_density() {
        // 30 % more mass, and a density of 0.85: 0.65 of the power move air, or it is not logged.
        let throttles = [1.3_f64.sqrt(), 0.85_f64.sqrt().recip()];
        for (throttle, efficiency) in [
            (throttles[0], Some(0.65)),
            (throttles[0], None),
            (throttles[1], None),
        ] {
            let mut recording = hall();
            let power = EFFICIENCY / efficiency.unwrap_or(EFFICIENCY) * throttle.powi(3);
            work(&mut recording.vehicles[0], throttle, power);
            if efficiency.is_none() {
                recording.vehicles[0].track.power_w = None;
            }
            let said = actuation(&recording);
            let cause = said.cause.expect("it departs");
            assert_eq!(cause.effect, "payload_mass");
            assert_eq!(cause.alternative, Some("air_density"));
            assert!(
                (cause.values[0] - throttle * throttle).abs() < 0.02,
                "{cause:?}"
            );
        }
    }

    #[test]
    fn a_step_of_throttle_without_its_power_is_no_payload() {
        let mut recording = hall();
        let track = &mut recording.vehicles[0].track;
        let half = track.t_s.len() / 2;
        let throttle = track.throttle_ratio.as_mut().expect("it is logged");
        throttle[half..].iter_mut().for_each(|ratio| *ratio *= 1.14);
        let said = actuation(&recording);
        assert!(said.cause.is_none() && said.is_contradicted, "{said:?}");
        let power = recording.vehicles[0]
            .track
            .power_w
            .as_mut()
            .expect("it is logged");
        power[half..]
            .iter_mut()
            .for_each(|watts| *watts *= 1.14_f64.powi(3));
        let cause = actuation(&recording).cause.expect("it is heavier");
        assert!((cause.values[0] - 1.3).abs() < 0.02, "{cause:?}");
    }

    #[test]
    fn the_load_of_one_of_several_drones_is_not_taken_for_all() {
        let mut recording = hall();
        let mut second = recording.vehicles[0].clone();
        second.id = "second".to_owned();
        recording.vehicles.push(second);
        assert_eq!(
            actuation(&recording),
            Actuation {
                is_confirmed: true,
                ..Actuation::default()
            }
        );
        work(&mut recording.vehicles[1], 1.14, 1.14_f64.powi(3));
        let said = actuation(&recording);
        assert!(said.cause.is_none() && said.is_contradicted, "{said:?}");
        let [remark] = &said.remarks[..] else {
            panic!("of one of them: {said:?}");
        };
        assert_eq!(remark.subject.as_deref(), Some("second"));
        assert!(
            remark.message.contains("a mass of 1.3"),
            "{}",
            remark.message
        );
        // Both alike.
        work(&mut recording.vehicles[0], 1.14, 1.14_f64.powi(3));
        assert_eq!(
            actuation(&recording).cause.expect("both").effect,
            "payload_mass"
        );
    }

    #[test]
    fn a_receiver_that_is_heavier_out_of_all_wakes_is_told() {
        let mut recording = hall();
        let mut receiver = recording.vehicles[0].clone();
        receiver.role = Role::Receiver;
        let places = receiver.track.position_m.iter_mut();
        places.for_each(|place| place.x += 20.0);
        work(&mut receiver, 1.14, 1.14_f64.powi(3));
        recording.vehicles.push(receiver);
        let said = actuation(&recording);
        assert!(said.cause.is_none() && !said.is_contradicted, "{said:?}");
        let load = said.receiver_load.expect("it is heavier");
        assert!((load.values[0] - 1.3).abs() < 0.02, "{load:?}");
        assert_eq!(said.remarks.len(), 1);
    }
}
