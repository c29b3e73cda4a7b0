//! What of a campaign is diagnosed, and from which beginning.

use crate::forward::low_pass::LowPass;
use crate::thrust::held_out::Share;
use crate::thrust::identify;

/// How a campaign is diagnosed.
#[derive(Clone, Debug, PartialEq)]
pub struct CampaignOptions {
    /// Recordings whose rows are judged, by index; empty: all. The others serve the thrust maps only.
    pub judge: Vec<usize>,
    /// Whether to begin with drones that fly alone, whatever the baseline says: no wakes at all.
    pub alone: bool,
    /// Rows judged within a second. Chosen here: the forces hold nothing above some 3 Hz.
    pub rate_hz: f64,
    /// Most rows judged; the rows that nothing is close to are thinned first.
    pub most_rows: usize,
    /// Most effects named.
    pub most_effects: usize,
    /// Which vehicles share a thrust map.
    pub share: Share,
    /// Ids of vehicles whose own force is not judged; their wakes still count.
    pub except: Vec<String>,
    /// How the thrust maps are identified, with the low-pass of everything compared.
    pub identify: identify::Options,
}

impl Default for CampaignOptions {
    fn default() -> CampaignOptions {
        CampaignOptions {
            judge: Vec::new(),
            alone: false,
            rate_hz: 10.0,
            most_rows: 6000,
            most_effects: 4,
            share: Share::Airframe,
            except: Vec::new(),
            identify: identify::Options {
                low_pass: LowPass { cutoff_hz: 3.0 },
                ..identify::Options::default()
            },
        }
    }
}
