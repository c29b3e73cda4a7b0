//! A finding held against recordings that it was not fitted to: what `plan simulate --finding`,
//! `plan diagnose --finding` and `plan diagnose --judge` share.

use std::path::Path;

use diagnosis::campaign::{Applied, CampaignOptions, Compared, apply, apply_campaign};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::infer::diagnose::DiagnoseError;
use diagnosis::infer::finding_file::{FindingFile, read_finding};
use diagnosis::infer::noticed::RemarkOf;
use diagnosis::record::recording::Recording;
use diagnosis::record::remark::{Remark, RemarkKind};

use super::diagnose::amount;
use crate::io::failure::Failure;
use crate::io::files::{self, MOST_SCENARIO_BYTES};
use crate::plots;
use crate::report::sections::{Figure, Part, Report};
use crate::report::words::{channel_words, count, joined, tally};

/// Rows of the table by flight at a terminal; the page and the JSON have all.
const SHOWN: usize = 12;

/// Reads a `finding.ron`.
pub(crate) fn read(path: &Path) -> Result<FindingFile, Failure> {
    let text = files::text(path, MOST_SCENARIO_BYTES).map_err(Failure::read(path))?;
    read_finding(&text).map_err(|error| Failure::Finding {
        path: path.to_owned(),
        error: error.into(),
    })
}

/// Judges a finding on recordings: all of them, or those of these indices where they are flight
/// logs and the others serve the thrust maps.
pub(crate) fn judge(
    recordings: &[Recording],
    judge: Vec<usize>,
    channel: Option<Channel>,
    finding: &FindingFile,
) -> Result<Applied, Failure> {
    let is_of_forces = recordings.iter().any(Recording::is_of_a_force);
    if is_of_forces && recordings.iter().all(Recording::is_flight_log) {
        let options = CampaignOptions {
            judge,
            alone: finding.is_alone,
        };
        return Ok(apply_campaign(recordings, &options, &finding.correction)?);
    }
    if is_of_forces {
        return Err(Failure::not_only_forces(recordings));
    }
    let applied = apply(recordings, channel, &finding.correction);
    let nothing = |channel| {
        let errors = recordings.iter();
        let errors = errors.map(|one| DiagnoseError::nothing_to_compare(one, Some(channel)));
        Failure::Diagnose(errors.collect())
    };
    applied.ok_or_else(|| match channel {
        Some(channel) => nothing(channel),
        None => Failure::nothing_to_compare(recordings.iter()),
    })
}

/// A remark on every recording, from one on, that has nothing of what was compared.
pub(crate) fn not_judged(
    recordings: &[Recording],
    from: usize,
    applied: &Applied,
) -> Vec<RemarkOf> {
    let is_judged = |at: usize| applied.plain.iter().any(|(of, _)| *of == at);
    let channel = channel_words(applied.channel).quantity;
    let message = format!("not judged: no {channel} that could be simulated");
    let remark = Remark::new(RemarkKind::Unused, None, message);
    let others = recordings.iter().enumerate().skip(from);
    let others = others.filter(|(at, _)| !is_judged(*at));
    others.map(|(_, one)| RemarkOf::new(one, &remark)).collect()
}

/// Whether it predicts these recordings better than the simulation as it is, nothing fitted.
pub(crate) fn helps(applied: &Applied) -> bool {
    let all = applied.all.first();
    all.is_some_and(|all| all.rms_after[1] < all.rms_before)
}

/// Of those that are judged, by the names of all, the names of recordings that it was found in.
fn fitted<'a>(names: &[&'a str], applied: &Applied, finding: &FindingFile) -> Vec<&'a str> {
    let judged = applied.plain.iter().map(|(of, _)| names[*of]);
    let is_known = |name: &&str| finding.recordings.iter().any(|known| known == name);
    judged.filter(is_known).collect()
}

/// What it does to recordings of these names.
pub(crate) fn section(
    report: &mut Report,
    recordings: &[&str],
    applied: &Applied,
    finding: &FindingFile,
) {
    let names = &finding.names;
    let what = match names.is_empty() {
        true => "The finding names nothing that is applied: after is as before.".to_owned(),
        false => format!("With {}.", joined(names.iter(), ", ")),
    };
    let begun = finding.begun.iter().map(|(name, t_s)| {
        Part::Line(format!(
            "{name} began at {t_s:.0} s of the recording that it was found in, which no other recording's clock tells: it is applied from the first second on."
        ))
    });
    let of_one_probe = finding.of_one_probe.iter().map(|(name, id)| {
        Part::Line(format!(
            "{name} is a fault of probe {id} of the recording that it was found in: it is not applied."
        ))
    });
    let known = fitted(recordings, applied, finding);
    let again = (!known.is_empty()).then(|| {
        let names = joined(known, ", ");
        Part::Line(format!(
            "The finding was found in {names}, or in another recording of that name: that it predicts it is no test."
        ))
    });
    let how = "Nothing is fitted here. Offset: of each drone or probe and recording the median of recorded minus simulated is taken off, before and after each its own. Intervals: 95 %, bootstrap over whole recordings, or over blocks of time where there are fewer than six; none of a single block.";
    let table = |rows: &[Compared]| {
        let headings = "where | offset | rows | recordings | rms before | after (95 %) | R2 before | after (95 %) | gained (95 %)";
        let rows = rows.iter().map(|row| cells(row, applied.channel));
        Part::table("llrrrrrrr", headings, rows)
    };
    let mut parts = vec![Part::Line(what)];
    parts.extend(begun);
    parts.extend(of_one_probe);
    parts.extend(again);
    parts.extend([
        Part::line(how),
        table(&applied.all),
        table(&applied.by_flight).shortened(SHOWN),
    ]);
    report.section("Finding applied", parts);
}

fn cells(row: &Compared, channel: Channel) -> Vec<String> {
    // One block has no interval.
    let with_ends = |[low, value, high]: [f64; 3], word: &dyn Fn(f64) -> String| match low
        .is_finite()
        && high.is_finite()
    {
        true => format!("{} ({} to {})", word(value), word(low), word(high)),
        false => word(value),
    };
    let r2 = |of: [f64; 3]| with_ends(of, &|value| format!("{value:.3}"));
    vec![
        row.rows_where.clone(),
        ["none", "one each"][usize::from(row.has_offsets)].to_owned(),
        row.rows.to_string(),
        row.recordings.to_string(),
        amount(row.rms_before, channel),
        with_ends(row.rms_after, &|value| amount(value, channel)),
        format!("{:.3}", row.r2_before),
        r2(row.r2_after),
        r2(row.r2_gained),
    ]
}

/// Residual maps and what else the samples allow, before and after.
pub(crate) fn figures(name: &str, recordings: &[Recording], applied: &Applied) -> Vec<Figure> {
    let draw = |samples: &[(usize, Vec<Sample>)]| {
        let all = samples
            .iter()
            .map(|(of, samples)| (&recordings[*of], &samples[..]));
        plots::simulation::draw(name, &all.collect::<Vec<_>>(), |_| None)
    };
    let sides = [("before", &applied.plain), ("after", &applied.corrected)];
    let drawn = sides.into_iter().flat_map(|(side, samples)| {
        draw(samples).into_iter().map(move |figure| Figure {
            name: format!("{side}-{}", figure.name),
            caption: format!("{side} the finding is applied. {}", figure.caption),
            ..figure
        })
    });
    drawn.collect()
}

/// `967 values of 1 recording (1 Kolibri), to which nothing was fitted`.
pub(crate) fn lead(recordings: &[Recording], applied: &Applied, finding: &FindingFile) -> String {
    let rows = applied.all.first().map_or(0, |all| all.rows);
    let names: Vec<&str> = recordings.iter().map(|one| &*one.name).collect();
    let judged = applied.plain.iter().map(|(of, _)| &recordings[*of]);
    let vehicles = judged.flat_map(|one| &one.vehicles);
    let kinds = tally(vehicles.map(|vehicle| vehicle.airframe.name()));
    let kinds = kinds
        .iter()
        .map(|(name, number)| format!("{number} {name}"));
    let to_others = match fitted(&names, applied, finding).is_empty() {
        true => ", to which nothing was fitted",
        false => "",
    };
    format!(
        "{} of {} ({}){to_others}",
        count(rows, "value", "values"),
        count(applied.plain.len(), "recording", "recordings"),
        joined(kinds, ", ")
    )
}
