//! One vehicle as its log has it: columns in SI, its rows in their order, nothing judged yet.

use std::collections::BTreeMap;

use nalgebra::UnitQuaternion;

use super::columns::{Columns, Role, RoleOf, Unit, groups};
use super::found::{Found, listed};
use super::table::Rows;
use crate::record::remark::RemarkKind;

/// One vehicle's rows: a column for each quantity that is there, in SI, as many entries in each;
/// NaN where a cell was empty. Of a group (velocity, quaternion, ...) all columns are there, or
/// none.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    pub(super) columns: BTreeMap<Role, Vec<f64>>,
}

impl Samples {
    /// The rows `mine` of one vehicle, times in seconds and everything in SI.
    pub(super) fn gather(
        vehicle: &str,
        (rows, columns): (&Rows, &Columns),
        mine: &[usize],
        gravity_mps2: f64,
        found: &mut Found,
    ) -> Samples {
        let mut samples = Samples::default();
        let mut empty = Vec::new();
        for ((&role, column), all) in columns.by_role.iter().zip(&rows.numbers) {
            let factor = match column.unit {
                Unit::Times(factor) => factor,
                Unit::Gravities => gravity_mps2,
            };
            let values: Vec<f64> = mine.iter().map(|&row| all[row] * factor).collect();
            if !role.is_required() && values.iter().all(|value| value.is_nan()) {
                empty.push(column.name.as_str());
            } else {
                samples.columns.insert(role, values);
            }
        }
        samples.settle(vehicle, found);
        if !empty.is_empty() {
            let message = format!("no value in any row of {}", listed(empty));
            found.remark(RemarkKind::Unused, Some(vehicle), message);
        }
        samples
    }

    /// Leaves whole groups alone: of a group that lacks a column nothing is used, of angles a
    /// missing one is taken as 0, and a quaternion goes before them.
    pub(super) fn settle(&mut self, vehicle: &str, found: &mut Found) {
        let rows = self.column(Role::Time).len();
        for (role, count) in groups() {
            if (0..count).any(|axis| !self.columns.contains_key(&role(axis))) {
                (0..count).for_each(|axis| drop(self.columns.remove(&role(axis))));
            }
        }
        let is_angle = |role: &Role| matches!(role, Role::Angle(_));
        if self.columns.contains_key(&Role::Quaternion(0)) {
            if self.columns.keys().any(is_angle) {
                let message = "roll, pitch and yaw are not used: there is a quaternion";
                found.remark(RemarkKind::Unused, Some(vehicle), message);
            }
            self.columns.retain(|role, _| !is_angle(role));
        } else if self.columns.keys().any(is_angle) {
            for (axis, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
                if !self.columns.contains_key(&Role::Angle(axis)) {
                    let message = format!("{angle} is not logged: taken as 0");
                    found.remark(RemarkKind::Assumed, Some(vehicle), message);
                }
                let column = self.columns.entry(Role::Angle(axis));
                column.or_insert_with(|| vec![0.0; rows]);
            }
        }
    }

    /// One column; empty where there is none.
    pub(super) fn column(&self, role: Role) -> &[f64] {
        self.columns.get(&role).map_or(&[], Vec::as_slice)
    }

    /// The columns of a group; `None` where there is no such group.
    pub(super) fn group<const N: usize>(&self, role: RoleOf) -> Option<[&[f64]; N]> {
        let group = std::array::from_fn(|axis| self.column(role(axis)));
        self.columns.contains_key(&role(0)).then_some(group)
    }

    /// From north-east-down with a body of forward-right-down to north-west-up with
    /// forward-left-up: half a turn about x, for the world and the body alike, which changes the
    /// sign of every y and z.
    pub(super) fn turn_up(&mut self) {
        for (role, column) in &mut self.columns {
            if let Role::Position(1 | 2)
            | Role::Velocity(1 | 2)
            | Role::Acceleration(1 | 2)
            | Role::Force(1 | 2)
            | Role::Quaternion(1 | 2)
            | Role::Angle(1 | 2) = role
            {
                column.iter_mut().for_each(|value| *value = -*value);
            }
        }
    }

    /// Adds quaternions of roll, pitch and yaw, about x, y, z in the order yaw, pitch, roll; with
    /// `turned`, pitch is logged with the other sign. The angles stay, to be judged as logged.
    pub(super) fn quaternions_from_angles(&mut self, turned: bool) {
        let Some([roll, pitch, yaw]) = self.group(Role::Angle) else {
            return;
        };
        let mut columns = [const { Vec::new() }; 4];
        for ((&roll, &pitch), &yaw) in roll.iter().zip(pitch).zip(yaw) {
            let pitch = if turned { -pitch } else { pitch };
            let attitude = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let parts = columns.iter_mut().zip(attitude.coords.iter());
            parts.for_each(|(column, part)| column.push(*part));
        }
        for (axis, column) in columns.into_iter().enumerate() {
            self.columns.insert(Role::Quaternion(axis), column);
        }
    }
}
