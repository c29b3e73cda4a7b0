//! Findings as people read them: where, what, how surely, and what to do next.

use std::collections::BTreeSet;

use diagnosis::forward::simulate::Channel;
use diagnosis::infer::candidates::Kind;
use diagnosis::infer::finding::{Effect, Finding, Ranked, Verdict, Withdrawn};
use diagnosis::infer::outside::{EXPECTED_READING, RELEASE, Shape};
use diagnosis::record::recording::{Recording, Role};
use diagnosis::statistics::lack_of_fit::ACCEPTED;

use crate::report::sections::{Figure, Part, Report};
use crate::report::words::{channel_words, count, each_once, figures, joined};

/// Candidates shown at a terminal; the page and the JSON have all.
const SHOWN: usize = 8;

/// Everything that is to be said of a finding: its figures stand with what they show.
pub(super) fn report(name: &str, what: String, finding: &Finding, drawn: Vec<Figure>) -> Report {
    let mut report = Report::new(format!("{name}: {}", verdict(finding)), what);
    let mut section = |heading, mut parts: Vec<Part>, figure| {
        let here = drawn.iter().find(|drawn| drawn.name == figure);
        parts.extend(here.cloned().map(Part::Figure));
        report.section(heading, parts);
    };
    section("Where", place(finding), "residuals");
    section("What", what_is_missing(finding), "signature");
    section("Candidates", candidates(finding), "");
    section("Fit", vec![Part::Line(fit(finding))], "agreement");
    section("Runners-up", runners_up(finding), "");
    section("What remains", remains(finding), "");
    let detectable = minimum_detectable(finding);
    section("Minimum detectable effects", detectable, "");
    report
}

/// The answer in a line.
pub(super) fn verdict(finding: &Finding) -> String {
    let first = joined(finding.effects.iter().map(Effect::label), " and ");
    match finding.verdict {
        _ if let Some(withdrawn) = &finding.withdrawn
            && finding.shape.is_none() =>
        {
            let names = joined(withdrawn.effects.iter().map(Effect::label), " and ");
            format!("{names} withdrawn: readings are predicted no better with it")
        }
        Verdict::None if finding.remains.is_sure => "no mismatch that is sure".into(),
        Verdict::None if is_unquiet(finding) => "no mismatch that repeats".into(),
        Verdict::None => "no mismatch above noise".into(),
        Verdict::Library => format!("{first}, {}", explained(finding)),
        Verdict::Ambiguous => {
            let either = |effect: &Effect| {
                let others = effect.alternatives.iter().cloned();
                joined(std::iter::once(effect.label()).chain(others), " or ")
            };
            let or = joined(finding.effects.iter().map(either), "; and ");
            let which = match finding.channel {
                Channel::VerticalForce => "these flights",
                _ => "the recording",
            };
            format!("{or}: {which} cannot tell")
        }
        Verdict::OutsideLibrary if first.is_empty() => {
            "a mismatch that no candidate explains".into()
        }
        Verdict::OutsideLibrary => format!("{first}, and a mismatch that no candidate explains"),
    }
}

/// Errors over the noise floor from which they are no longer called noise. Chosen here.
pub(super) const UNQUIET: f64 = 1.5;

/// Whether what is left is clearly more than neighbouring readings scatter by.
fn is_unquiet(finding: &Finding) -> bool {
    finding.held_out.rms_after > UNQUIET * finding.held_out.noise_floor
}

/// Whether what trees predict may be errors that outlast a block, such as a place's own while a
/// probe dwells there: readings alone are held out by blocks, and the global test, which allows for
/// such errors, finds nothing.
fn may_outlast_a_block(finding: &Finding) -> bool {
    let is_by_blocks = finding.channel != Channel::VerticalForce;
    let is_none = finding.verdict == Verdict::None && finding.p > ACCEPTED;
    is_by_blocks && is_none && finding.remains.is_sure
}

/// `1240 readings of 1 probe below 1 drone (offboard-2), 1240 s`.
pub(super) fn what(recording: &Recording, finding: &Finding) -> String {
    let emitters = recording.vehicles.iter();
    let emitters = || emitters.clone().filter(|v| v.role != Role::Receiver);
    let what = match finding.channel {
        Channel::Speed => {
            let probes = recording.probes.iter().flat_map(|probes| &probes.samples);
            let ids: BTreeSet<u32> = probes.map(|sample| sample.probe_id).collect();
            let readings = count(finding.samples, "reading", "readings");
            format!("{readings} of {}", count(ids.len(), "probe", "probes"))
        }
        channel => {
            let quantity = channel_words(channel).quantity;
            format!("{} values of a receiver's {quantity}", finding.samples)
        }
    };
    let thinned = match finding.fitted_every {
        1 => String::new(),
        every => format!(", of which every {} was fitted", ordinal(every)),
    };
    format!(
        "{what} below {} ({}){thinned}",
        count(emitters().count(), "drone", "drones"),
        each_once(emitters().map(|vehicle| vehicle.airframe.name()))
    )
}

/// `3rd`.
fn ordinal(number: usize) -> String {
    let ending = match (number % 10, number % 100) {
        (1, tens) if tens != 11 => "st",
        (2, tens) if tens != 12 => "nd",
        (3, tens) if tens != 13 => "rd",
        _ => "th",
    };
    format!("{number}{ending}")
}

/// A value of a channel with its unit; forces on small drones in thousandths.
pub(crate) fn amount(value: f64, channel: Channel) -> String {
    match channel {
        Channel::VerticalForce => format!("{:.1} mN", 1e3 * value),
        _ => measured(value, channel_words(channel).unit),
    }
}

fn measured(value: f64, unit: &str) -> String {
    match unit {
        "1" | "" => figures(value),
        unit => format!("{} {unit}", figures(value)),
    }
}

/// How much of the error that noise does not make is gone.
fn explained(finding: &Finding) -> String {
    let held_out = &finding.held_out;
    let above = |rms: f64| (rms * rms - held_out.noise_floor * held_out.noise_floor).max(0.0);
    let before = above(held_out.rms_before);
    let is_told_elsewhere = finding.effects.iter().any(|of| !is_candidate(finding, of));
    if is_told_elsewhere && held_out.rms_after >= held_out.rms_before {
        return "of which throttle and power tell, and these readings by themselves nothing".into();
    }
    if before <= 0.0 {
        return "within the noise".into();
    }
    let share = 1.0 - above(held_out.rms_after) / before;
    match share {
        ..0.005 => "which takes nothing off the error above noise".into(),
        ..0.995 => format!(
            "which explains {:.0} % of the error above noise",
            100.0 * share
        ),
        _ => "which explains the error above noise".into(),
    }
}

/// Whether an effect was fitted to these readings, and not told by throttle and power before.
fn is_candidate(finding: &Finding, effect: &Effect) -> bool {
    finding.candidates.iter().any(|of| of.name == effect.name)
}

/// One line a recording.
pub(super) fn summary(found: &[(&Recording, Finding)]) -> Report {
    let row = |(recording, finding): &(&Recording, Finding)| {
        let held_out = &finding.held_out;
        let amount = |value| amount(value, finding.channel);
        vec![
            recording.name.clone(),
            finding.samples.to_string(),
            finding.verdict.as_str().to_owned(),
            format!("{:.0} %", 100.0 * finding.region.share),
            amount(held_out.rms_before),
            amount(held_out.rms_after),
            amount(held_out.noise_floor),
            names(finding),
        ]
    };
    let with = |verdict: Verdict| found.iter().filter(|(_, f)| f.verdict == verdict).count();
    let title = format!(
        "{}: {} with nothing missing, {} explained, {} ambiguous, {} unexplained",
        count(found.len(), "recording", "recordings"),
        with(Verdict::None),
        with(Verdict::Library),
        with(Verdict::Ambiguous),
        with(Verdict::OutsideLibrary)
    );
    let headings = "recording | samples | verdict | where | before | after | noise | what";
    let table = Part::table("lrlrrrrl", headings, found.iter().map(row));
    let below = Part::line("before, after: rms error on blocks that were not fitted");
    let mut report = Report::new(title, String::new());
    report.section("", vec![table, below]);
    report
}

/// `crossflow (or wake_tilt), payload_mass`.
fn names(finding: &Finding) -> String {
    let name = |effect: &Effect| match effect.alternatives.is_empty() {
        true => effect.label(),
        false => format!("{} (or {})", effect.label(), effect.alternatives.join(", ")),
    };
    joined(finding.effects.iter().map(name), ", ")
}

fn place(finding: &Finding) -> Vec<Part> {
    let region = &finding.region;
    let nowhere = "Nowhere: what is left of recorded minus simulated is noise, and what the instrument's maker allows.";
    let mut parts = match finding.verdict {
        Verdict::None if finding.p > ACCEPTED && !finding.remains.is_sure => {
            vec![match is_unquiet(finding) {
                false => Part::line(nowhere),
                true => Part::Line(format!(
                    "Nowhere that repeats: errors are {:.1} times the noise floor{}, and nothing predicts them on {} that were not fitted.",
                    finding.held_out.rms_after / finding.held_out.noise_floor,
                    match (finding.channel, finding.errors_follow) {
                        (Channel::VerticalForce, _) => "",
                        (_, true) => ", in stretches longer than neighbouring readings tell",
                        (_, false) => ", for single readings lie far from all others",
                    },
                    parts_of(finding.channel)
                )),
            }]
        }
        Verdict::None if may_outlast_a_block(finding) => vec![Part::Line(format!(
            "Nowhere that is sure; what may repeat stands under {}.",
            section_of_the_rest(finding.channel)
        ))],
        Verdict::None if finding.remains.is_sure => vec![Part::Line(format!(
            "Nowhere that an effect of the library shows; what repeats all the same stands under {}.",
            section_of_the_rest(finding.channel)
        ))],
        Verdict::None => vec![Part::line(
            "Nowhere by as much as matters: what the test below finds is faint.",
        )],
        _ if is_unexplained(finding) => vec![Part::Line(format!(
            "Nowhere in particular: nothing predicts where, on {} that were not fitted.",
            parts_of(finding.channel)
        ))],
        _ if region.sample_indices.is_empty() => {
            vec![Part::line(
                "Nowhere that a correction would change by half of the noise.",
            )]
        }
        _ => {
            let here = format!(
                "{}: {} of {} samples, {:.0} %.",
                region.description,
                region.sample_indices.len(),
                finding.samples,
                100.0 * region.share
            );
            vec![Part::Line(here), Part::Line(error(finding))]
        }
    };
    let p = p_value(finding.p);
    let beside = match finding.verdict {
        Verdict::None => "",
        _ if finding.p <= ACCEPTED => "",
        _ if finding.withdrawn.is_some() && finding.shape.is_none() => {
            " It knows nothing of what points to the answer that was withdrawn."
        }
        _ if is_told_by_actuation(finding) => {
            " It looks at these readings alone; throttle and power say what is named."
        }
        _ => &format!(
            " It allows for errors that outlast a block, so by itself it would not tell; what is said here rests on {} that were not fitted.",
            parts_of(finding.channel)
        ),
    };
    parts.push(Part::Line(format!(
        "Global lack-of-fit test: p-value {p}.{beside}"
    )));
    parts
}

/// Whether something is there of which nothing is predicted, not even when.
fn is_unexplained(finding: &Finding) -> bool {
    let shape = finding.shape.as_ref();
    shape.is_some_and(|shape| !shape.is_predictable && shape.spans_s.is_empty())
}

/// Whether what is named was named before any reading was fitted.
fn is_told_by_actuation(finding: &Finding) -> bool {
    finding.shape.is_none()
        && !finding.effects.is_empty()
        && !finding.effects.iter().any(|of| is_candidate(finding, of))
}

/// Standard errors of a mean that are more than chance: 95 % of a normal law.
const TOLD: f64 = 1.96;
/// Most that a share of the recorded mean may be to be told, in percent. Chosen here: where next to
/// nothing is recorded, a share of it says nothing.
const MOST_PERCENT: f64 = 1000.0;

fn error(finding: &Finding) -> String {
    let region = &finding.region;
    let is_high = region.mean_error < 0.0;
    let too = if is_high { "too high" } else { "too low" };
    let amount = |value: f64| amount(value, finding.channel);
    let size = amount(region.mean_error.abs());
    let percent = 100.0 * region.relative_error.abs();
    let count = region.sample_indices.len() as f64;
    let is_one_sided = region.mean_error.abs() > TOLD * region.rms_error / count.sqrt();
    let by = match finding.channel {
        _ if !is_one_sided => format!(
            "too high at times and too low at others, by {} rms",
            amount(region.rms_error)
        ),
        // A force has both signs: a share of its mean says nothing.
        Channel::VerticalForce => format!("{too} by {size} in the mean (up is positive)"),
        _ if percent > MOST_PERCENT => {
            format!("{too} by {size} in the mean, where next to nothing is recorded")
        }
        _ => format!("{percent:.1} % {too} in the mean ({size})"),
    };
    let times = region.error_over_noise;
    format!("There the simulation is {by}; its error is {times:.1} times the noise.")
}

/// Below a ten-thousandth only that it is.
fn p_value(p: f64) -> String {
    match p {
        ..1e-4 => "below 0.0001".into(),
        ..0.01 => format!("{p:.4}"),
        _ => format!("{p:.2}"),
    }
}

fn what_is_missing(finding: &Finding) -> Vec<Part> {
    if finding.verdict == Verdict::None {
        let nothing = match (finding.remains.is_sure, is_unquiet(finding)) {
            (true, _) if may_outlast_a_block(finding) => "No effect of the library shows for sure.",
            (true, _) => "No effect of the library shows here.",
            (false, false) => "Nothing is missing that would show here.",
            (false, true) => {
                "Readings differ by more than neighbours do, and nothing that repeats predicts when, so no effect is named."
            }
        };
        return vec![Part::line(nothing)];
    }
    let mut parts = Vec::new();
    if let Some(withdrawn) = &finding.withdrawn {
        parts.push(Part::Line(taken_back(finding, withdrawn)));
    }
    if let Some(shape) = &finding.shape {
        parts.extend(outside(finding, shape).into_iter().map(Part::Line));
    }
    for effect in &finding.effects {
        let (name, description) = (effect.label(), &effect.description);
        let size = match effect.too_small {
            true => " Present, too small to matter for planning.",
            false => "",
        };
        parts.push(Part::Line(format!("{name}: {description}.{size}")));
        parts.push(Part::line(&effect.equation));
        parts.push(parameters(effect));
    }
    if !finding.effects.is_empty() {
        parts.push(Part::Line(format!(
            "95 % of a parameter that was fitted: 1.96 standard errors to either side, from the scatter of scores over {} and from how far each law itself may be off; cut at the ends of a parameter's range. t0: where the log likelihood of all readings falls by 1.92; the level of a saturation: the resolution.",
            parts_of(finding.channel)
        )));
    }
    parts
}

/// Why an answer does not stand.
fn taken_back(finding: &Finding, withdrawn: &Withdrawn) -> String {
    let of = |effect: &Effect| {
        let values = effect.parameters.iter();
        let values = values.map(|(name, of)| {
            let value = measured(of.value, &of.unit);
            format!(
                "{name} {value}, {} to {}",
                figures(of.low),
                figures(of.high)
            )
        });
        let values = joined(values, "; ");
        format!("{} ({}: {values})", effect.name, effect.description)
    };
    let [before, after] = apart(
        [finding.held_out.rms_before, withdrawn.rms_after],
        finding.channel,
    );
    let p = match withdrawn.p < 1.0 {
        true => format!("p-value {:.2}, by blocks", withdrawn.p),
        false => "no better by more than chance, by blocks".to_owned(),
    };
    format!(
        "{} is withdrawn: with it the rms error on {} that were not fitted goes from {before} to {after} ({p}). Something is there that these readings do not explain; nothing of it is in finding.ron.",
        joined(withdrawn.effects.iter().map(of), " and "),
        parts_of(finding.channel)
    )
}

/// Two amounts, with as many figures as tell them apart.
fn apart([one, other]: [f64; 2], channel: Channel) -> [String; 2] {
    let plain = [one, other].map(|value| amount(value, channel));
    if plain[0] != plain[1] || one == other {
        return plain;
    }
    let (scale, unit) = match channel {
        Channel::VerticalForce => (1e3, "mN"),
        _ => (1.0, channel_words(channel).unit),
    };
    let digits = |value: f64, digits: usize| match unit {
        "1" | "" => format!("{:.digits$}", scale * value),
        unit => format!("{:.digits$} {unit}", scale * value),
    };
    let more = (3..9).map(|count| [digits(one, count), digits(other, count)]);
    let mut more = more.filter(|[one, other]| one != other);
    more.next().unwrap_or(plain)
}

/// Part of what can be gained from which a nearest effect is said to come near. Chosen here.
const NEARLY_ALL: f64 = 0.8;

/// Something without a name, in sentences.
fn outside(finding: &Finding, shape: &Shape) -> Vec<String> {
    let mut lines = vec![
        match (shape.is_predictable, &shape.nearest) {
            (false, _) if finding.remains.is_sure => format!("Something is there that no effect of the library explains on {} that were not fitted, so none is named and nothing is corrected; what repeats all the same stands under {}.", parts_of(finding.channel), section_of_the_rest(finding.channel)),
            (false, _) if shape.spans_s.is_empty() => "Something is there that these readings do not explain: no effect of the library, and no function of the covariates, lowers the error on blocks that were not fitted. Nothing is corrected.".to_owned(),
            (false, _) => "Readings differ at times by more than noise; nothing that repeats predicts when, so no effect is named.".to_owned(),
            (true, Some((name, share))) if *share >= NEARLY_ALL => format!(
                "Something repeats that no effect of the library has. {name} comes near, with {:.0} % of the log likelihood that can be gained on blocks that were not fitted, but {}.",
                100.0 * share,
                short_of(finding, name)
            ),
            (true, Some((name, share))) if *share >= 0.01 => format!(
                "Something repeats that no effect of the library has. Nearest is {name}, which predicts {:.0} % of what can be predicted on blocks that were not fitted.",
                100.0 * share
            ),
            (true, _) => "No effect of the library, alone or with another, predicts this on blocks that were not fitted; something else that repeats does.".to_owned(),
        },
    ];
    if !shape.spans_s.is_empty() {
        let spans = shape.spans_s.iter();
        let spans = spans.map(|[from, to]| format!("{from:.0} to {to:.0} s"));
        lines.push(format!("When: {}.", joined(spans, ", ")));
        return lines;
    }
    if !shape.is_predictable {
        return lines;
    }
    if let Some(period_s) = shape.period_s {
        lines.push(format!(
            "It pulsates with a period of {} s, on the clock of {}.",
            figures(period_s),
            match shape.depends_on.iter().any(|(name, _)| name == RELEASE) {
                true => "the air's release",
                false => "the readings",
            }
        ));
        return lines;
    }
    let on = shape.depends_on.iter().filter(|(_, share)| *share >= 0.005);
    let on = on.map(|(name, share)| format!("{name} ({:.0} %)", 100.0 * share));
    let place = match shape.is_of_a_probe() {
        true => ": one instrument's own, or what stands in its place",
        false => "",
    };
    lines.push(format!("It depends on {}{place}.", joined(on, ", ")));
    if shape
        .depends_on
        .iter()
        .any(|(name, _)| name == EXPECTED_READING)
    {
        lines.push(
            "A curve of the reading alone tells more than every effect of the library: the scale of an instrument, sooner than air."
                .to_owned(),
        );
    }
    lines.push(match &shape.expression {
        Some(expression) => format!(
            "In short: {expression}, which explains {:.0} % of what can be predicted of it.",
            100.0 * shape.expression_share
        ),
        None => "No short expression predicts it.".to_owned(),
    });
    lines.push(format!(
        "Where it shows it changes what is read by {:.0} %{}.",
        100.0 * shape.part,
        match shape.is_small() {
            true => ": present, too small to matter for planning",
            false => "",
        }
    ));
    lines.push(
        "The correction that is drawn here holds where samples were taken and nowhere else; it cannot be flown."
            .to_owned(),
    );
    lines
}

/// Why the nearest effect is no explanation.
fn short_of(finding: &Finding, nearest: &str) -> &'static str {
    let of_it = finding.candidates.iter().filter(|of| of.name == nearest);
    match of_it.max_by(|a, b| a.gain.total_cmp(&b.gain)) {
        Some(of) if of.at_bound => "a parameter is at the end of its range",
        _ => "leaves more of the error than its law may be off",
    }
}

fn parameters(effect: &Effect) -> Part {
    let rows = effect.parameters.iter().map(|(name, estimate)| {
        let interval = match estimate.low < estimate.high {
            _ if estimate.at_bound => "at the end of its range".to_owned(),
            true => format!("{} to {}", figures(estimate.low), figures(estimate.high)),
            false => String::new(),
        };
        let value = measured(estimate.value, &estimate.unit);
        vec![format!("  {name}"), value, interval]
    });
    Part::table("lrr", " | value | 95 %", rows)
}

fn candidates(finding: &Finding) -> Vec<Part> {
    let taken = |ranked: &Ranked| finding.effects.iter().any(|effect| is_of(effect, ranked));
    let row = |ranked: &Ranked| {
        let values = ranked.parameters.iter();
        let values = values.map(|(name, value)| format!("{name} {}", figures(*value)));
        let mark = match (taken(ranked), ranked.at_bound, ranked.practical) {
            (true, false, true) => "taken",
            (true, false, false) => "taken, too small to matter",
            (_, true, _) => "at the end of its range",
            (false, _, true) => "",
            (false, _, false) => "too small to matter",
        };
        vec![
            ranked.label(),
            format!("{:+.1}", ranked.gain),
            format!("{:.1}", ranked.gain_error),
            joined(values, "  "),
            mark.to_owned(),
        ]
    };
    let gain = format!(
        "Gain: log likelihood of {} that were not fitted, over that of the simulation as it is.",
        parts_of(finding.channel)
    );
    let headings = "each alone | gain | +- | fitted |";
    let table = Part::table("lrrll", headings, finding.candidates.iter().map(row));
    vec![Part::Line(gain), table.shortened(SHOWN)]
}

/// Whether an effect is this candidate: from some moment on, or of one probe, is another.
fn is_of(effect: &Effect, ranked: &Ranked) -> bool {
    let sets_in = [
        effect.parameters.contains_key("t0"),
        ranked.parameters.contains_key("t0"),
    ];
    effect.label() == ranked.label() && sets_in[0] == sets_in[1]
}

fn fit(finding: &Finding) -> String {
    let held_out = &finding.held_out;
    let parts = parts_of(finding.channel);
    let [low, high, floor] = [
        held_out.rms_after_low,
        held_out.rms_after_high,
        held_out.noise_floor,
    ]
    .map(|value| amount(value, finding.channel));
    let [before, after] = apart([held_out.rms_before, held_out.rms_after], finding.channel);
    format!(
        "rms error on {parts} that were not fitted: {before} before, {after} after ({low} to {high}); noise floor {floor}.{}",
        tolerance(finding)
    )
}

/// What gain and offset of the instrument, within what its maker allows, errors were taken with.
fn tolerance(finding: &Finding) -> String {
    let held_out = &finding.held_out;
    let both = [held_out.tolerance_before, held_out.tolerance_after];
    if both == [[0.0; 2]; 2] {
        return String::new();
    }
    let of = |[gain, offset]: [f64; 2]| {
        let unit = channel_words(finding.channel).unit;
        // Rounded first: there is no -0.
        let rounded = |value: f64, to: f64| (to * value).round() / to + 0.0;
        let (percent, offset) = (rounded(100.0 * gain, 10.0), rounded(offset, 1000.0));
        format!("{percent:+.1} % and {offset:+.3} {unit}")
    };
    let [before, after] = both.map(of);
    let (best, mean) = match held_out.instruments > 1 {
        true => ("each probe's own gain and offset", ", on average"),
        false => ("the gain and the offset", ""),
    };
    match before == after {
        true => format!(
            " Both are with {best} that fit best within the instrument's tolerance{mean}: {before}."
        ),
        false => format!(
            " They are with {best} that fit best within the instrument's tolerance{mean}: {before} before, {after} after."
        ),
    }
}

/// What is held out together: forces are judged over whole flights.
fn parts_of(channel: Channel) -> &'static str {
    match channel {
        Channel::VerticalForce => "flights",
        _ => "blocks",
    }
}

/// The section that tells what trees still predict.
fn section_of_the_rest(channel: Channel) -> &'static str {
    match channel {
        Channel::VerticalForce => "runners-up",
        _ => "what remains",
    }
}

fn runners_up(finding: &Finding) -> Vec<Part> {
    let effects = finding.effects.iter();
    let ambiguous = effects.filter(|effect| !effect.alternatives.is_empty());
    let mut lines: Vec<String> = ambiguous
        .map(|Effect { name, kind, alternatives, .. }| {
            let others = alternatives.join(", ");
            match kind {
                Some(Kind::Sensor) => format!(
                    "An instrument that does what {name} says explains this as well as {others}: check the instrument first."
                ),
                _ => format!("{name} cannot be told from {others} here."),
            }
        })
        .collect();
    if let (Some(second), [effect, ..]) = (&finding.runner_up, finding.effects.as_slice()) {
        lines.push(format!(
            "Runner-up beside {}: {} would gain {:.1} +- {:.1} more on held-out blocks, too small a part of the whole to be told from an error in the form of the first, so it is not taken.",
            effect.name, second.name, second.gain, second.gain_error
        ));
    }
    let lines_are_rivals = !lines.is_empty();
    if lines.is_empty() {
        let none = match finding.effects.len() {
            0 => "Nothing is named, so there is nothing to tell it from.",
            1 => "No runner-up is left to tell apart.",
            _ => "No other effect does as well in the place of either.",
        };
        lines.push(rival(finding).unwrap_or_else(|| none.into()));
    }
    let mut parts: Vec<Part> = lines.into_iter().map(Part::Line).collect();
    if !finding.advice.is_empty() {
        let what = match (finding.verdict, lines_are_rivals) {
            (Verdict::OutsideLibrary, _) => "To narrow it down, measure:",
            (_, true) => "To decide, measure:",
            _ => "To confirm, measure:",
        };
        parts.push(Part::line(what));
        parts.push(Part::Steps(finding.advice.clone()));
    }
    parts
}

/// What trees still predict after all that is named.
fn remains(finding: &Finding) -> Vec<Part> {
    // Of flights it is told beside the runner-up.
    if finding.channel == Channel::VerticalForce {
        return Vec::new();
    }
    let remains = &finding.remains;
    let [gain, error] = [remains.gain, remains.gain_error];
    let text = match remains.is_sure {
        // In a few blocks it gains much.
        false if gain > error.max(1.0) => format!(
            "Nothing more that surely repeats: any function of the covariates (regression trees) gains {gain:.0} +- {error:.0} on blocks that it has not seen, much in some and little in others."
        ),
        false => format!(
            "Nothing more that repeats: any function of the covariates (regression trees) gains {gain:.0} +- {error:.0} on blocks that it has not seen."
        ),
        true if may_outlast_a_block(finding) => format!(
            "Perhaps something that repeats: any function of the covariates (regression trees) gains {gain:.0} +- {error:.0} on blocks that it has not seen, {} rms. So do errors that outlast a block, such as a place's own while a probe dwells there; the global test, which allows for these, finds no more than chance (p-value {}). Short visits to the same places, in another order, would tell.",
            amount(remains.rms, finding.channel),
            p_value(finding.p)
        ),
        true => format!(
            "Something more repeats: any function of the covariates (regression trees) gains {gain:.0} +- {error:.0} on blocks that it has not seen, {} rms; it exceeds half of the noise in {:.0} % of the samples ({}).",
            amount(remains.rms, finding.channel),
            100.0 * remains.share,
            remains.description
        ),
    };
    let held_out = &finding.held_out;
    let is_answer = finding.verdict != Verdict::None;
    let unquiet = (is_answer && is_unquiet(finding)).then(|| {
        Part::Line(format!(
            "Errors on blocks that were not fitted are still {:.1} times the noise floor.",
            held_out.rms_after / held_out.noise_floor
        ))
    });
    std::iter::once(Part::Line(text)).chain(unquiet).collect()
}

/// The best of those that were not taken, and how far behind it is.
fn rival(finding: &Finding) -> Option<String> {
    let [effect] = finding.effects.as_slice() else {
        return None;
    };
    let mut candidates = finding.candidates.iter();
    let taken = candidates.find(|ranked| is_of(effect, ranked))?;
    let others = finding.candidates.iter();
    let next = others
        .filter(|c| c.name != effect.name && c.gain > c.gain_error)
        .max_by(|a, b| a.gain.total_cmp(&b.gain));
    Some(match next {
        Some(next) if next.gain < taken.gain => format!(
            "Runner-up: {}, alone, gains {:.1} less.",
            next.name,
            taken.gain - next.gain
        ),
        Some(next) => format!(
            "{}, alone, gains {:.1} more, and was not taken: {}.",
            next.name,
            next.gain - taken.gain,
            match next.at_bound {
                true => "a parameter is at the end of its range",
                false => "its gain is less sure, or readings are predicted no better with it",
            }
        ),
        None => "No other candidate gains more than the standard error of its gain.".to_owned(),
    })
}

/// Least that is not printed as 0.
const LEAST_PRINTED: f64 = 0.001;

fn minimum_detectable(finding: &Finding) -> Vec<Part> {
    let rows = finding.detectable.iter().map(|one| {
        // No effect is detected of no size at all.
        let least = match figures(one.departure).parse() {
            Ok(0.0) => format!("below {}", measured(LEAST_PRINTED, &one.unit)),
            _ => measured(one.departure, &one.unit),
        };
        vec![one.name.clone(), one.parameter.clone(), least]
    });
    let how = "Each alone would have been detected from this departure from neutral on (power 80 %, at the level of the test above, beside what gain and offset may take). Of what is not listed no departure in its range would have been; a ceiling shows only where it is reached.";
    vec![
        Part::line(how),
        Part::table("llr", "effect | by | at least", rows),
    ]
}

#[cfg(test)]
mod tests;
