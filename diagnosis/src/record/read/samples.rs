//! One vehicle as its log has it: columns in SI, its rows in their order, nothing judged yet.

use super::columns::{Columns, Role, Unit};
use super::found::{Found, listed};
use super::table::Rows;
use crate::record::remark::RemarkKind;

/// One vehicle's rows. Every column that is there has as many entries; NaN where a cell was empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    pub(super) t_s: Vec<f64>,
    pub(super) position_m: Vec<[f64; 3]>,
    pub(super) velocity_mps: Option<Vec<[f64; 3]>>,
    /// Whatever kind the metadata say it is.
    pub(super) acceleration_mps2: Option<Vec<[f64; 3]>>,
    pub(super) attitude: Option<Attitude>,
    pub(super) duty: Option<Vec<[f64; 4]>>,
    pub(super) battery_v: Option<Vec<f64>>,
    pub(super) throttle_ratio: Option<Vec<f64>>,
    pub(super) power_w: Option<Vec<f64>>,
}

/// Attitude as logged.
#[derive(Clone, Debug)]
pub(super) enum Attitude {
    /// x, y, z, w.
    Quaternion(Vec<[f64; 4]>),
    /// Roll, pitch, yaw (rad), about x, y, z in the order yaw, pitch, roll.
    Angles(Vec<[f64; 3]>),
}

const POSITION: [Role; 3] = [Role::Position(0), Role::Position(1), Role::Position(2)];
const VELOCITY: [Role; 3] = [Role::Velocity(0), Role::Velocity(1), Role::Velocity(2)];
const ACCELERATION: [Role; 3] = [
    Role::Acceleration(0),
    Role::Acceleration(1),
    Role::Acceleration(2),
];
const QUATERNION: [Role; 4] = [
    Role::Quaternion(0),
    Role::Quaternion(1),
    Role::Quaternion(2),
    Role::Quaternion(3),
];
const DUTY: [Role; 4] = [Role::Duty(0), Role::Duty(1), Role::Duty(2), Role::Duty(3)];
const ANGLES: [Role; 3] = [Role::Roll, Role::Pitch, Role::Yaw];

/// Groups of columns of which some without the others mean nothing. Angles are not among them: a missing one is taken as 0.
pub(super) const GROUPS: [&[Role]; 4] = [&VELOCITY, &ACCELERATION, &QUATERNION, &DUTY];

impl Samples {
    /// The rows of one vehicle, times in seconds and everything in SI.
    pub(super) fn gather(
        vehicle: &str,
        rows: &Rows,
        columns: &Columns,
        mine: &[usize],
        gravity_mps2: f64,
        found: &mut Found,
    ) -> Samples {
        let mut gather = Gather {
            rows,
            columns,
            mine,
            gravity_mps2,
            empty: Vec::new(),
        };
        let angles_logged = ANGLES.iter().any(|&role| columns.has(&[role]));
        let quaternion = gather.group(QUATERNION).map(Attitude::Quaternion);
        let angles = |gather: &mut Gather<'_>| {
            let [roll, pitch, yaw] = ANGLES.map(|role| gather.column(role));
            let none = roll.is_none() && pitch.is_none() && yaw.is_none();
            let zero = || vec![0.0; mine.len()];
            (!none).then(|| {
                let [roll, pitch, yaw] =
                    [roll, pitch, yaw].map(|column| column.unwrap_or_else(zero));
                Attitude::Angles(transposed([roll, pitch, yaw]))
            })
        };
        let attitude = quaternion.or_else(|| angles(&mut gather));
        if angles_logged && matches!(attitude, Some(Attitude::Angles(_))) {
            let missing = [
                (Role::Roll, "roll"),
                (Role::Pitch, "pitch"),
                (Role::Yaw, "yaw"),
            ]
            .into_iter()
            .filter(|(role, _)| !columns.has(&[*role]));
            for (_, angle) in missing {
                let message = format!("{angle} is not logged: taken as 0");
                found.remark(RemarkKind::Assumed, Some(vehicle), message);
            }
        }
        let samples = Samples {
            t_s: gather.column(Role::Time).unwrap_or_default(),
            position_m: gather.group(POSITION).unwrap_or_default(),
            velocity_mps: gather.group(VELOCITY),
            acceleration_mps2: gather.group(ACCELERATION),
            attitude,
            duty: gather.group(DUTY),
            battery_v: gather.column(Role::Battery),
            throttle_ratio: gather.column(Role::Throttle),
            power_w: gather.column(Role::Power),
        };
        if !gather.empty.is_empty() {
            let names = listed(gather.empty.iter().map(String::as_str));
            let message = format!("no value in any row of {names}");
            found.remark(RemarkKind::Unused, Some(vehicle), message);
        }
        samples
    }

    /// From north-east-down with a body of forward-right-down to north-west-up with forward-left-up: half a turn about x, for
    /// the world and the body alike, which changes the sign of every y and z.
    pub(super) fn turn_up(&mut self) {
        let flip = |vector: &mut [f64; 3]| {
            vector[1] = -vector[1];
            vector[2] = -vector[2];
        };
        self.position_m.iter_mut().for_each(flip);
        for column in [&mut self.velocity_mps, &mut self.acceleration_mps2]
            .into_iter()
            .flatten()
        {
            column.iter_mut().for_each(flip);
        }
        match &mut self.attitude {
            Some(Attitude::Quaternion(quaternions)) => {
                for [_, y, z, _] in quaternions {
                    (*y, *z) = (-*y, -*z);
                }
            }
            Some(Attitude::Angles(angles)) => angles.iter_mut().for_each(flip),
            None => {}
        }
    }
}

/// Takes columns out of a table, those of one vehicle.
struct Gather<'a> {
    rows: &'a Rows,
    columns: &'a Columns,
    mine: &'a [usize],
    gravity_mps2: f64,
    /// Names of columns that hold nothing.
    empty: Vec<String>,
}

impl Gather<'_> {
    /// `None` where there is no such column, or nothing in it.
    fn column(&mut self, role: Role) -> Option<Vec<f64>> {
        let (index, (_, column)) = self
            .columns
            .by_role
            .iter()
            .enumerate()
            .find(|(_, (known, _))| **known == role)?;
        let factor = match column.unit {
            Unit::Times(factor) => factor,
            Unit::Gravities => self.gravity_mps2,
        };
        let all = &self.rows.numbers[index];
        let values: Vec<f64> = self.mine.iter().map(|&row| all[row] * factor).collect();
        let is_required = matches!(role, Role::Time | Role::Position(_));
        if !is_required && values.iter().all(|value| value.is_nan()) {
            self.empty.push(column.name.clone());
            return None;
        }
        Some(values)
    }

    fn group<const N: usize>(&mut self, roles: [Role; N]) -> Option<Vec<[f64; N]>> {
        if !self.columns.has(&roles) {
            return None;
        }
        let columns = roles.map(|role| self.column(role));
        if columns.iter().any(Option::is_none) {
            return None;
        }
        Some(transposed(columns.map(Option::unwrap_or_default)))
    }
}

fn transposed<const N: usize>(columns: [Vec<f64>; N]) -> Vec<[f64; N]> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .map(|row| std::array::from_fn(|axis| columns[axis][row]))
        .collect()
}
