//! The worst drones of a flight over time: altitude error and air, with and without feed-forward.

use flight::feed_forward::FeedForward;
use flight::report::{FlightReport, Trace, Traces};

use super::axes::Chart;
use super::canvas::{Canvas, HEAD, dashed, polyline, solid};
use super::colours::{INK, SERIES, WORST};
use super::legend::{Entry, LINE, sheet};
use crate::report::sections::Figure;
use crate::report::words::shortest;

/// One chart (px).
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 220.0;

/// Altitude on the left, air on the right, one row for each drone; `None` where none met any air.
pub(crate) fn draw(flown: &FlightReport) -> Option<Figure> {
    let rows = flown.worst.len();
    let svg = (rows > 0).then(|| {
        let title = format!("Altitude and air of the worst drones: {}", flown.scenario);
        let subtitle = "those whose air exceeds their limit most, or comes nearest to it";
        let size = (2.0 * WIDTH, HEAD + LINE + 8.0 + HEIGHT * rows as f64);
        let entries = [
            Entry::line(&solid(SERIES[0], 1.4), "without feed-forward"),
            Entry::line(&solid(SERIES[1], 1.4), "with"),
            Entry::line(&dashed(WORST, 1.2), "limit"),
        ];
        let (mut canvas, below) = sheet(size, (&title, subtitle), &entries);
        for (traces, areas) in flown.worst.iter().zip(below.grid(rows, 2).chunks(2)) {
            let [without, with] = chosen(flown, traces);
            let Some((k, without)) = without else {
                continue;
            };
            let case = &flown.flights[k].case;
            let heading = format!(
                "{}: {}, air {}",
                traces.drone,
                case.controller.as_str(),
                shortest(case.convection, 3)
            );
            let both = [Some(without), with.map(|(_, trace)| trace)];
            let altitude = both.map(|it| it.map(|trace| &trace.altitude_error_m[..]));
            let alpha = both.map(|it| it.map(|trace| &trace.alpha[..]));
            let words = (heading.as_str(), "altitude error (m)");
            chart(&mut canvas, (areas[0], words), traces, (altitude, None));
            let limit = Some(traces.air_limit);
            let words = ("air over its own induced velocity", "alpha");
            chart(&mut canvas, (areas[1], words), traces, (alpha, limit));
        }
        canvas.finish()
    });
    let caption = "Of each drone the flight in which it met most air without feed-forward, and the same flight with feed-forward: late, or the paper's where late was not flown.";
    Figure::of("flight", svg, caption)
}

/// The flight without feed-forward in which a drone met most air, and its like with.
fn chosen<'a>(flown: &FlightReport, traces: &'a Traces) -> [Option<(usize, &'a Trace)>; 2] {
    let all = || flown.flights.iter().zip(&traces.flights).enumerate();
    let most = |trace: &Trace| trace.alpha.iter().flatten().copied().fold(0.0, f32::max);
    let without = all()
        .filter(|(_, (flight, _))| flight.case.feed_forward == FeedForward::None)
        .map(|(k, (_, trace))| (k, trace))
        .reduce(|a, b| if most(b.1) > most(a.1) { b } else { a });
    let Some((k, _)) = without else {
        return [None, None];
    };
    let here = &flown.flights[k].case;
    let with = |wanted: FeedForward| {
        let like = all().find(|(_, (flight, _))| {
            let case = &flight.case;
            case.feed_forward == wanted
                && case.controller == here.controller
                && case.convection == here.convection
        });
        like.map(|(k, (_, trace))| (k, trace))
    };
    [
        without,
        with(FeedForward::Late).or_else(|| with(FeedForward::Paper)),
    ]
}

/// Values over time; none: it does not fly.
type Values<'a> = Option<&'a [Option<f32>]>;

/// Two lines over time, gaps where the drone does not fly.
fn chart(
    canvas: &mut Canvas,
    (area, (heading, label)): (super::canvas::Area, (&str, &str)),
    traces: &Traces,
    (lines, limit): ([Values<'_>; 2], Option<f64>),
) {
    let values = || lines.iter().flatten().flat_map(|it| it.iter().flatten());
    let low = values().fold(0.0, |so_far: f64, it| so_far.min(f64::from(*it)));
    let high = values().fold(limit.unwrap_or(0.0), |so_far, it| {
        so_far.max(f64::from(*it))
    });
    let room = 0.05 * (high - low).max(1e-3);
    let steps = lines.iter().flatten().map(|it| it.len()).max().unwrap_or(0);
    let at_s = |step: usize| traces.from_s + step as f64 * traces.step_s;
    let x = ("time (s)", (traces.from_s, at_s(steps.max(2))));
    let low = if low < 0.0 { low - room } else { 0.0 };
    let chart = Chart::draw(canvas, area, heading, [x, (label, (low, high + room))]);
    chart.grid(canvas);
    if let Some(limit) = limit {
        chart.line(
            canvas,
            [x.1.0, x.1.1].map(|s| (s, limit)),
            &dashed(WORST, 1.2),
        );
    }
    for (line, colour) in lines.iter().zip([SERIES[0], SERIES[1]]) {
        let Some(line) = line else { continue };
        let mut path = String::new();
        let mut from = 0;
        for run in line.chunk_by(|a, b| a.is_some() == b.is_some()) {
            let points = run
                .iter()
                .enumerate()
                .filter_map(|(k, value)| Some(chart.at((at_s(from + k), f64::from((*value)?)))));
            path += &polyline(points);
            from += run.len();
        }
        canvas.path(&path, &solid(colour, 1.3));
    }
    if low < 0.0 {
        chart.line(canvas, [x.1.0, x.1.1].map(|s| (s, 0.0)), &solid(INK, 0.6));
    }
}
