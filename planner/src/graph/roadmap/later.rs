//! Stops that are wanted once the roadmap is made already.

use super::{Links, Roadmap, Stop, Survey, Vertex};
use crate::scenario::solid::Solids;
use crate::scenario::world::Bounds;

impl Roadmap {
    /// Highest radius of a body for which clearances are known (m).
    pub(crate) fn widest_m(&self) -> f64 {
        self.widest_m
    }

    /// Connects more stops; returns the vertex of each. All others keep their numbers.
    pub(crate) fn connect(
        &mut self,
        bounds: &Bounds,
        solids: Option<&Solids>,
        stops: &[Stop],
    ) -> Vec<Vertex> {
        let lattice = self.lattice.clone();
        let survey = Survey {
            lattice: &lattice,
            solids,
            floor_z_m: bounds.min.z,
            widest_m: self.widest_m,
        };
        let open =
            |place: Vertex, radius_m: f64| self.ways(place).any(|(_, way)| way.fits(radius_m));
        let mut links = Links::new(&survey, bounds, &open, self.places_m.clone());
        let vertices = stops.iter().map(|stop| links.connect(stop)).collect();
        let (places_m, ways) = (links.places_m, links.ways);
        self.places_m = places_m;
        // In ascending order still: stops of later come after all others.
        self.add(ways);
        vertices
    }
}
