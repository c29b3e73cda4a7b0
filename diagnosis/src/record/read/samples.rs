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
        let mut attitude = gather.group(Role::Quaternion).map(Attitude::Quaternion);
        if attitude.is_none() {
            let angles = [0, 1, 2].map(|axis| gather.column(Role::Angle(axis)));
            if angles.iter().any(Option::is_some) {
                for (axis, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
                    if !columns.has(Role::Angle(axis)) {
                        let message = format!("{angle} is not logged: taken as 0");
                        found.remark(RemarkKind::Assumed, Some(vehicle), message);
                    }
                }
                let angles = angles.map(|angle| angle.unwrap_or_else(|| vec![0.0; mine.len()]));
                attitude = Some(Attitude::Angles(transposed(angles)));
            }
        }
        let samples = Samples {
            t_s: gather.column(Role::Time).unwrap_or_default(),
            position_m: gather.group(Role::Position).unwrap_or_default(),
            velocity_mps: gather.group(Role::Velocity),
            acceleration_mps2: gather.group(Role::Acceleration),
            attitude,
            duty: gather.group(Role::Duty),
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

    /// All values of a row but its time.
    pub(super) fn row(&self, row: usize) -> Vec<f64> {
        let mut values = self.position_m[row].to_vec();
        for vectors in [&self.velocity_mps, &self.acceleration_mps2]
            .into_iter()
            .flatten()
        {
            values.extend(vectors[row]);
        }
        match &self.attitude {
            Some(Attitude::Quaternion(all)) => values.extend(all[row]),
            Some(Attitude::Angles(all)) => values.extend(all[row]),
            None => {}
        }
        values.extend(self.duty.iter().flat_map(|duty| duty[row]));
        let scalars = [&self.battery_v, &self.throttle_ratio, &self.power_w];
        values.extend(scalars.into_iter().flatten().map(|column| column[row]));
        values
    }

    /// From north-east-down with a body of forward-right-down to north-west-up with
    /// forward-left-up: half a turn about x, for the world and the body alike, which changes the
    /// sign of every y and z.
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

    /// `None` unless all columns of the group are there, with something in each.
    fn group<const N: usize>(&mut self, role: fn(usize) -> Role) -> Option<Vec<[f64; N]>> {
        let roles: [Role; N] = std::array::from_fn(role);
        if !roles.iter().all(|&role| self.columns.has(role)) {
            return None;
        }
        let columns = roles.map(|role| self.column(role));
        let is_whole = columns.iter().all(Option::is_some);
        is_whole.then(|| transposed(columns.map(Option::unwrap_or_default)))
    }
}

fn transposed<const N: usize>(columns: [Vec<f64>; N]) -> Vec<[f64; N]> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .map(|row| std::array::from_fn(|axis| columns[axis][row]))
        .collect()
}
