//! Flight logs of one campaign, diagnosed together by the vertical forces on their drones.

use diagnosis::campaign::skill::{Curve, Skill, UNDER_ANOTHER};
use diagnosis::campaign::{
    CampaignError, CampaignFinding, CampaignOptions, LEAST_OFFSET_N, SidewaysFinding, near_floor,
};
use diagnosis::forward::simulate::Channel;
use diagnosis::infer::finding::Verdict;
use diagnosis::record::recording::Recording;

use super::words;
use crate::io::failure::Failure;
use crate::plots;
use crate::report::sections::{Part, Report};
use crate::report::words::joined;

/// What of the flights is judged, and from which beginning.
pub(crate) fn options(
    recordings: &[Recording],
    alone: bool,
    near_the_floor: bool,
) -> Result<CampaignOptions, Failure> {
    let judge = match near_the_floor {
        true => near_floor(recordings)?,
        false => Vec::new(),
    };
    Ok(CampaignOptions { alone, judge })
}

/// `4777 values of the vertical force in 88 flights, from drones that fly alone`.
fn what(found: &CampaignFinding, options: &CampaignOptions) -> String {
    let from = match options.alone {
        true => "simulated as if each drone flew alone",
        false => "simulated with the hover jets of the drones above",
    };
    let (rows, flights) = (found.finding.samples, found.flights);
    format!("{rows} values of the vertical force in {flights} flights, {from}")
}

/// The report of a single recording, with what whole flights add.
pub(super) fn report(
    name: &str,
    (found, sideways): (&CampaignFinding, &Result<SidewaysFinding, CampaignError>),
    options: &CampaignOptions,
) -> Report {
    let finding = &found.finding;
    let what = what(found, options);
    let subtitle = format!("{what}; {}", words::verdict(finding));
    let figures = plots::finding::draw_campaign(name, found, &subtitle);
    let mut report = words::report(name, what, finding, figures);
    for section in &mut report.sections {
        match section.heading {
            "Where" => {
                section.parts.extend(located(found));
                section.parts.push(offsets(found));
            }
            "What" => section.parts.extend(taken(found)),
            "Fit" => {
                section.parts.push(skills(&found.skills));
                section.parts.extend(found.curves.iter().map(curve));
            }
            "Runners-up" => section.parts.extend(left(found)),
            _ => {}
        }
    }
    report.section("Forces to the sides", to_the_sides(sideways));
    report
}

/// Most effects that were not taken, and vehicles that lack something, in the text. Chosen here:
/// the nearest, and the first.
const MOST_NOT_TAKEN: usize = 3;

/// What forces sideways say, or why they say nothing.
fn to_the_sides(sideways: &Result<SidewaysFinding, CampaignError>) -> Vec<Part> {
    let found = match sideways {
        Ok(found) => found,
        Err(why) => return vec![Part::line(format!("Cannot be judged: {why}."))],
    };
    let [recorded, before, after] = [
        found.rms_recorded_mps2,
        found.rms_before_mps2,
        found.rms_after_mps2,
    ];
    let of = format!(
        "{} moments of {} flights in {} blocks of 15 s",
        found.samples, found.flights, found.blocks
    );
    let lead = match found.effects.is_empty() {
        true => format!(
            "Of {of}: no effect predicts blocks that it was not fitted on. Force over mass {recorded:.3} m/s2 rms, {before:.3} beside the wakes."
        ),
        false => format!(
            "Of {of}: {} named. Force over mass {recorded:.3} m/s2 rms, {before:.3} beside the wakes, {after:.3} with them in blocks that were not fitted.",
            joined(found.effects.iter().map(|of| of.name.clone()), ", ")
        ),
    };
    let mut parts = vec![Part::Line(lead)];
    for of in &found.effects {
        let mut text = format!(
            "{}: {}; gain {:.0} +- {:.0}",
            of.name, of.description, of.gain, of.gain_error
        );
        if !of.alternatives.is_empty() {
            text += &format!("; not told apart from {}", of.alternatives.join(", "));
        }
        parts.push(Part::Line(text + "."));
        let rows = of.parameters.iter().map(|parameter| {
            let error = parameter.standard_error.map(|error| format!("{error:.4}"));
            let value = format!("{:.4}", parameter.value);
            let cells = [parameter.name.clone(), value, error.unwrap_or_default()];
            cells.into_iter().chain([parameter.unit.clone()]).collect()
        });
        parts.push(Part::table("lrrl", "parameter | value | +- | unit", rows).shortened(8));
    }
    if after > words::UNQUIET * found.noise_mps2 {
        parts.push(Part::Line(format!(
            "What remains is {after:.3} m/s2 rms, {:.1} times what moments half a second apart differ by: something else acts sideways, or an instrument drifts, that no effect here explains.",
            after / found.noise_mps2
        )));
    }
    let nearest = found.not_taken.iter().take(MOST_NOT_TAKEN);
    let nearest = nearest.map(|(name, gain, error)| format!("{name} {gain:.0} +- {error:.0}"));
    parts.push(Part::Line(format!(
        "Not taken, with what they would gain: {}.",
        joined(nearest, ", ")
    )));
    let (shown, more) = found
        .lacking
        .split_at(found.lacking.len().min(MOST_NOT_TAKEN));
    let mut lacking = shown.to_vec();
    if !more.is_empty() {
        lacking.push(format!("and {} more, see diagnosis.json", more.len()));
    }
    parts.extend(Part::list(lacking));
    parts
}

/// What stands out without any candidate; a hint where nothing is said to be missing.
fn located(found: &CampaignFinding) -> Option<Part> {
    let located = found.located.as_ref()?;
    let lead = match found.finding.verdict {
        Verdict::None => "What stands out most, no more than a hint",
        _ => "Found without any candidate",
    };
    Some(Part::Line(format!(
        "{lead}: {}, {:.0} % of the values, where recorded minus simulated is {} in the mean (p-value {:.3}).",
        located.description,
        100.0 * located.share,
        newton(located.mean_error_n),
        located.p
    )))
}

/// What each flight may be off by, which no figure here counts.
fn offsets(found: &CampaignFinding) -> Part {
    Part::Line(format!(
        "One offset a drone and flight is taken off first, for a thrust map is known no better: they scatter by {}{}.",
        // Flights that agree better than that are taken to scatter by it.
        if found.offset_n > LEAST_OFFSET_N {
            ""
        } else {
            "at most "
        },
        newton(found.offset_n)
    ))
}

/// In which order, and what else was tried in each place.
fn taken(found: &CampaignFinding) -> Option<Part> {
    let rival =
        |(name, gain, error): &(String, f64, f64)| format!("{name} {gain:.0} +- {error:.0}");
    let rows = found.taken.iter().map(|taken| {
        vec![
            taken.name.clone(),
            format!("{:.0}", taken.gain),
            format!("{:.0}", taken.gain_error),
            (taken.r2_gained).map_or(String::new(), |[low, value, high]| {
                format!("{value:+.3} ({low:+.3} to {high:+.3})")
            }),
            joined(taken.rivals.iter().take(2).map(rival), ", "),
        ]
    });
    let mut skills = found.skills.iter();
    let over = match skills.any(|skill| skill.rows_where == UNDER_ANOTHER) {
        true => " under a drone",
        false => "",
    };
    let headings = format!("taken in this order | gain | +- | R2{over} (95 %) | in its place");
    (!found.taken.is_empty()).then(|| Part::table("lrrrl", &headings, rows))
}

fn skills(skills: &[Skill]) -> Part {
    let rows = skills.iter().map(|skill| {
        let [low, after, high] = skill.rms_after_n.map(newton);
        let [r2_low, r2, r2_high] = skill.r2_after;
        vec![
            skill.rows_where.clone(),
            skill.rows.to_string(),
            skill.flights.to_string(),
            newton(skill.rms_before_n),
            format!("{after} ({low} to {high})"),
            format!("{:.2}", skill.r2_before),
            format!("{r2:.2} ({r2_low:.2} to {r2_high:.2})"),
        ]
    });
    let headings = "flights held out whole | rows | flights | rms before | after (95 %) | R2 before | after (95 %)";
    Part::table("lrrrrrr", headings, rows)
}

/// For the page alone.
fn curve(curve: &Curve) -> Part {
    let rows = (0..curve.bins.len()).map(|i| {
        let [from, to] = curve.bins[i];
        let (recorded_n, error_n) = (&curve.recorded_n, &curve.error_n);
        let forces = [recorded_n, &curve.before_n, &curve.after_n, error_n];
        let mut cells = vec![format!("{from:.2} to {to:.2}"), curve.rows[i].to_string()];
        cells.extend(forces.map(|force_n| newton(force_n[i])));
        cells
    });
    let along = curve.along.replace('|', "/");
    let headings = format!("{along} | rows | recorded | before | after | +-");
    Part::table("lrrrrr", &headings, rows).shortened(0)
}

fn newton(force_n: f64) -> String {
    words::amount(force_n, Channel::VerticalForce)
}

/// What was not taken, and what is left.
fn left(found: &CampaignFinding) -> Vec<Part> {
    let next = found.next.iter().map(|(name, gain, error)| {
        format!("Runner-up: {name} would gain {gain:.0} +- {error:.0} more, which is too little or rests on too few flights.")
    });
    let ([before, left], error) = (found.flexible_gain, found.flexible_gain_error);
    let remains = &found.finding.remains;
    let flexible = match (remains.is_sure, found.finding.shape.is_some()) {
        (true, _) => format!(
            "Any function of the covariates (regression trees) gains {left:.0} +- {error:.0} more in flights that it has not seen: there is more, without a name here."
        ),
        (false, true) => format!(
            "Any function of the covariates (regression trees) gains {before:.0} on the simulation as it is, and on what is left {left:.0} +- {error:.0}, which is no more than chance: what is told above shows in square errors, where large ones count most, or in time."
        ),
        (false, false) => format!(
            "Any function of the covariates (regression trees) gains {before:.0} on the simulation as it is, and nothing on what is left ({left:.0} +- {error:.0})."
        ),
    };
    next.chain([flexible]).map(Part::Line).collect()
}
