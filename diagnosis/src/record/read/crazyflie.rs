//! The Crazyflie's names of logged values, known in advance: in tables that cfclient and cflib
//! write, and on its card.

use std::borrow::Cow;

use super::campaign::Campaign;
use super::columns;
use super::conventions::{Acceleration, Pitch};

/// Names of the Crazyflie's log variables (bitcraze.io, "Log groups and variables"; cfclient and
/// cflib write them as headers), each with ours, whose unit is theirs.
const NAMES: [(&str, &str); 29] = [
    ("t_ms", "timestamp"),
    ("t_ms", "Timestamp"),
    ("x_m", "stateEstimate.x"),
    ("y_m", "stateEstimate.y"),
    ("z_m", "stateEstimate.z"),
    ("x_mm", "stateEstimateZ.x"),
    ("y_mm", "stateEstimateZ.y"),
    ("z_mm", "stateEstimateZ.z"),
    ("vx_mps", "stateEstimate.vx"),
    ("vy_mps", "stateEstimate.vy"),
    ("vz_mps", "stateEstimate.vz"),
    ("vx_mmps", "stateEstimateZ.vx"),
    ("vy_mmps", "stateEstimateZ.vy"),
    ("vz_mmps", "stateEstimateZ.vz"),
    ("qx", "stateEstimate.qx"),
    ("qy", "stateEstimate.qy"),
    ("qz", "stateEstimate.qz"),
    ("qw", "stateEstimate.qw"),
    ("roll_deg", "stateEstimate.roll"),
    ("pitch_deg", "stateEstimate.pitch"),
    ("yaw_deg", "stateEstimate.yaw"),
    ("ax_g", "acc.x"),
    ("ay_g", "acc.y"),
    ("az_g", "acc.z"),
    ("pwm1_u16", "motor.m1"),
    ("pwm2_u16", "motor.m2"),
    ("pwm3_u16", "motor.m3"),
    ("pwm4_u16", "motor.m4"),
    ("vbat_v", "pm.vbat"),
];

/// The campaign with what a header of the Crazyflie's names says without words: which column is
/// what, that acceleration is specific force in the body (in gravities), and that pitch is positive
/// with the nose up. What the campaign says itself is kept; of two names for one quantity the first
/// of the table is taken. Another header changes nothing.
pub(super) fn completed<'c>(campaign: &'c Campaign, header: &[String]) -> Cow<'c, Campaign> {
    let is_there = |theirs: &str| header.iter().any(|column| column == theirs);
    // A time alone may be anyone's.
    if !NAMES
        .iter()
        .any(|(_, theirs)| theirs.contains('.') && is_there(theirs))
    {
        return Cow::Borrowed(campaign);
    }
    let mut campaign = campaign.clone();
    let means = |name: &str| columns::meaning(name).map(|(role, _)| role);
    let columns = &mut campaign.columns.0;
    let own = header
        .iter()
        .filter(|name| columns.iter().all(|(_, theirs)| theirs != *name));
    let mut known: Vec<_> = own.filter_map(|name| means(name)).collect();
    known.extend(columns.iter().filter_map(|(ours, _)| means(ours)));
    let (mut is_acceleration, mut is_pitch) = (false, false);
    for (ours, theirs) in NAMES {
        let is_named = columns.iter().any(|of| of.1 == theirs);
        is_acceleration |= is_named && theirs.starts_with("acc.");
        is_pitch |= is_named && theirs == "stateEstimate.pitch";
        let Some(role) = means(ours).filter(|role| is_there(theirs) && !known.contains(role))
        else {
            continue;
        };
        known.push(role);
        columns.push((ours.to_owned(), theirs.to_owned()));
        is_acceleration |= role == columns::Role::Acceleration(0);
        is_pitch |= role == columns::Role::Angle(1);
    }
    if is_acceleration {
        campaign
            .acceleration
            .get_or_insert(Acceleration::SpecificForceInBody);
    }
    if is_pitch {
        campaign.pitch.get_or_insert(Pitch::NoseUp);
    }
    Cow::Owned(campaign)
}

/// Whether one of the Crazyflie's names in a header says this.
pub(super) fn says(role: columns::Role, header: &[String]) -> bool {
    let means = |ours: &str| columns::meaning(ours).is_some_and(|(of, _)| of == role);
    let mut named = NAMES.iter().filter(|(ours, _)| means(ours));
    named.any(|(_, theirs)| header.iter().any(|column| column == theirs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pitch_that_the_campaign_names_itself_has_the_crazyflies_sign_too() {
        let mut campaign = Campaign::of_no_one();
        let named = ("pitch_deg".to_owned(), "stateEstimate.pitch".to_owned());
        campaign.columns.0.push(named);
        let header = ["timestamp", "stateEstimate.pitch"].map(str::to_owned);
        assert_eq!(completed(&campaign, &header).pitch, Some(Pitch::NoseUp));
    }
}
