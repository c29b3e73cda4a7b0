//! Words for a place at which a drone cannot be.

use super::problem::Problem;
use super::written;
use crate::scenario::placement::{Misfit, Misplaced, Spot};
use crate::scenario::world::World;

pub(super) fn misplacement(world: &World, source: &written::Drone, found: &Misplaced) -> Problem {
    let name = &source.name;
    let place = match found.spot {
        Spot::Start => &source.start_m,
        Spot::Task(index) => &source.tasks[index].to_m,
        Spot::Landing => source
            .tasks
            .last()
            .map_or(&source.start_m, |task| &task.to_m),
    };
    let (who, verb, word) = match found.spot {
        Spot::Start => (format!("`{name}`"), "starts", "start"),
        Spot::Task(index) => (format!("task {} of `{name}`", index + 1), "lies", "place"),
        Spot::Landing => (format!("`{name}`"), "lands", "place to come down from"),
    };
    let nearest = found.nearest_m.map(|nearest_m| {
        let [x, y, z] = nearest_m.coords.into();
        format!("nearest free {word} is ({x:.2}, {y:.2}, {z:.2})")
    });
    let problem = match found.why {
        Misfit::OutOfBounds { by_m } => {
            Problem::at(&place.at, format!("{who} {verb} out of bounds"))
                .label(format!("{by_m:.2} m outside"))
        }
        Misfit::Obstacle {
            obstacle,
            distance_m,
            needs_m,
        } => {
            let solid = &world.obstacles[obstacle].name;
            let needs = format!("its body needs {needs_m:.2} m to the face");
            if found.spot == Spot::Landing {
                let rest_z_m = found.place_m.z;
                Problem::at(&place.at, format!("{who} {verb} in obstacle `{solid}`")).label(format!(
                    "coming down from here to z = {rest_z_m:.2} m it passes {:.2} m from it; {needs}",
                    distance_m.max(0.0)
                ))
            } else if distance_m <= 0.0 {
                Problem::at(&place.at, format!("{who} {verb} inside obstacle `{solid}`"))
                    .label(format!("{:.2} m inside; {needs}", -distance_m))
            } else {
                Problem::at(
                    &place.at,
                    format!("{who} {verb} too near to obstacle `{solid}`"),
                )
                .label(format!("{distance_m:.2} m from it; {needs}"))
            }
        }
    };
    problem.maybe_help(nearest)
}
