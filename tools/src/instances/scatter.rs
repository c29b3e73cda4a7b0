//! Random starts and goals in columns of their own, and the generator that draws them.

use super::InstanceError;
use super::scene::{Flight, OFFBOARD_2};
use diagnosis::statistics::draws::Draws;

/// The heavy drone of a mixed fleet.
pub(super) const MATRICE_300: &str = "matrice-300";
/// Every so manieth drone of a mixed fleet is heavy: chosen here.
const EVERY: usize = 10;

/// One airframe: starts in distinct columns, goals in distinct columns, heights free.
pub(super) fn alike(
    name: &'static str,
    columns: &[[f64; 2]],
    levels: usize,
    drones: usize,
    seed: u64,
) -> Result<Vec<Flight>, InstanceError> {
    if drones > columns.len() {
        return Err(InstanceError::TooMany {
            name,
            drones,
            room: columns.len(),
        });
    }
    let mut random = Draws::new(seed);
    let mut places = || -> Vec<[f64; 3]> {
        let mut columns = columns.to_vec();
        (0..drones)
            .map(|taken| {
                let chosen = taken + random.below(columns.len() - taken);
                columns.swap(taken, chosen);
                let [x, y] = columns[taken];
                [x, y, random.below(levels) as f64 + 0.5]
            })
            .collect()
    };
    let (starts, goals) = (places(), places());
    Ok(starts
        .into_iter()
        .zip(goals)
        .map(|(start_m, goal_m)| Flight {
            airframe: OFFBOARD_2,
            start_m,
            goal_m,
        })
        .collect())
}

/// Every tenth drone a Matrice 300, on an open square floor. The eight columns around a Matrice 300
/// stay free of others' starts, or goals: its body and another's would touch there (tips at 0.71 m,
/// an Offboard 2's at 0.20 m, and 0.1 m of clearance), and from two columns on no drone is exposed
/// beyond its limit.
pub(super) fn mixed(
    side: usize,
    levels: usize,
    drones: usize,
    seed: u64,
) -> Result<Vec<Flight>, InstanceError> {
    let mut random = Draws::new(seed);
    let mut draws = [(); 2].map(|()| Draw::new(side, &mut random));
    let room = draws.iter().map(Draw::room).min().unwrap_or(0);
    if drones > room {
        return Err(InstanceError::TooManyMixed { drones, seed, room });
    }
    let [starts, goals] = draws
        .each_mut()
        .map(|draw| draw.places(drones, levels, &mut random));
    Ok(starts
        .into_iter()
        .zip(goals)
        .enumerate()
        .map(|(index, (start_m, goal_m))| Flight {
            airframe: if is_heavy(index) {
                MATRICE_300
            } else {
                OFFBOARD_2
            },
            start_m,
            goal_m,
        })
        .collect())
}

fn is_heavy(index: usize) -> bool {
    index % EVERY == EVERY - 1
}

/// Columns in a random order, for a mixed fleet of any size that has room: a larger one takes more
/// of them.
struct Draw {
    side: usize,
    /// All columns, shuffled.
    order: Vec<usize>,
    /// Those of them that a Matrice 300 can have if all before it have theirs.
    heavy: Vec<usize>,
}

impl Draw {
    fn new(side: usize, random: &mut Draws) -> Draw {
        let mut order: Vec<usize> = (0..side * side).collect();
        for taken in 0..order.len() {
            let chosen = taken + random.below(order.len() - taken);
            order.swap(taken, chosen);
        }
        let mut kept = vec![false; order.len()];
        let mut heavy = Vec::new();
        for &column in &order {
            if !kept[column] {
                // Two keep apart if neither stands beside the other.
                around(side, column).for_each(|near| kept[near] = true);
                heavy.push(column);
            }
        }
        Draw { side, order, heavy }
    }

    /// The columns left to others once so many of the heavy have theirs.
    fn left(&self, heavy: usize) -> Vec<usize> {
        let mut kept = vec![false; self.order.len()];
        for &column in self.heavy.iter().take(heavy) {
            around(self.side, column).for_each(|near| kept[near] = true);
        }
        let open = |column: &usize| !kept[*column];
        self.order.iter().copied().filter(open).collect()
    }

    /// The largest fleet.
    fn room(&self) -> usize {
        let mut kept = vec![false; self.order.len()];
        let mut open = self.order.len();
        let mut room = 0;
        for heavy in 0..=self.heavy.len() {
            if heavy > 0 {
                for near in around(self.side, self.heavy[heavy - 1]) {
                    open -= usize::from(!std::mem::replace(&mut kept[near], true));
                }
            }
            // So many heavy ones fly in fleets of 10 heavy .. 10 heavy + 9.
            let lightest = heavy * EVERY - heavy;
            if open < lightest {
                break;
            }
            room = heavy + open.min(lightest + EVERY - 1);
        }
        room
    }

    /// A place for each drone of a fleet that has room.
    fn places(&mut self, drones: usize, levels: usize, random: &mut Draws) -> Vec<[f64; 3]> {
        let mut light = self.left(drones / EVERY).into_iter();
        let mut heavy = self.heavy.iter().copied();
        (0..drones)
            .filter_map(|index| {
                let column = if is_heavy(index) {
                    heavy.next()
                } else {
                    light.next()
                }?;
                Some([
                    (column % self.side) as f64 + 0.5,
                    (column / self.side) as f64 + 0.5,
                    random.below(levels) as f64 + 0.5,
                ])
            })
            .collect()
    }
}

/// A column of a square floor and those beside it.
fn around(side: usize, column: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (column % side, column / side);
    let beside = move |at: usize| at.saturating_sub(1)..=(at + 1).min(side - 1);
    beside(y).flat_map(move |y| beside(x).map(move |x| y * side + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(places: &[[f64; 3]]) -> Vec<[i64; 2]> {
        places
            .iter()
            .map(|[x, y, _]| [*x as i64, *y as i64])
            .collect()
    }

    #[test]
    fn starts_have_columns_of_their_own_and_so_have_goals() {
        let floor: Vec<[f64; 2]> = (0..81)
            .map(|k| [f64::from(k % 9) + 0.5, f64::from(k / 9) + 0.5])
            .collect();
        let flights = alike("test", &floor, 8, 81, 5).expect("81 columns");
        for pick in [|f: &Flight| f.start_m, |f: &Flight| f.goal_m] {
            let places: Vec<[f64; 3]> = flights.iter().map(pick).collect();
            let mut seen = columns(&places);
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), 81);
        }
    }

    #[test]
    fn a_matrice_keeps_the_columns_around_its_own_free_up_to_the_last_drone_that_fits() {
        let Err(InstanceError::TooManyMixed { room, .. }) = mixed(64, 8, usize::MAX, 7) else {
            panic!("no drone has so much room");
        };
        assert!(matches!(
            mixed(64, 8, room + 1, 7),
            Err(InstanceError::TooManyMixed { .. })
        ));
        let flights = mixed(64, 8, room, 7).expect("it fits");
        assert_eq!(flights.len(), room);
        for pick in [|f: &Flight| f.start_m, |f: &Flight| f.goal_m] {
            let places: Vec<[f64; 3]> = flights.iter().map(pick).collect();
            let columns = columns(&places);
            for (one, a) in columns.iter().enumerate() {
                for (other, b) in columns.iter().enumerate().take(one) {
                    let apart = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                    let least = if is_heavy(one) || is_heavy(other) {
                        2
                    } else {
                        1
                    };
                    assert!(apart >= least, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn the_generator_is_splitmix64() {
        // First outputs for seed 1234567, of the public-domain reference implementation by S.
        // Vigna.
        let mut random = Draws::new(1_234_567);
        assert_eq!(
            [random.bits(), random.bits()],
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]
        );
    }
}
