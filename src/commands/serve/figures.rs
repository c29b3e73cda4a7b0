//! What is counted and timed, for Prometheus.

use std::sync::atomic::AtomicU64;
use std::time::{Duration, Instant};

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

/// Upper ends of the histogram of patches (s): from what one drone takes to what no client waits
/// for.
const PATCH_S: [f64; 12] = [
    0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0,
];
/// The content type of what [`Figures::text`] gives (OpenMetrics 1.0).
pub(super) const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Names and values of a sample.
type Labels = Vec<(&'static str, String)>;

pub(super) struct Figures {
    registry: Registry,
    began: Instant,
    requests: Family<Labels, Counter>,
    patches: Counter,
    patch_s: Histogram,
    pub(super) revision: Gauge,
    pub(super) drones: Gauge,
    up_s: Gauge<f64, AtomicU64>,
    pub(super) connections: Gauge,
    pub(super) waiting: Gauge,
    pub(super) listeners: Gauge,
    pub(super) dropped: Counter,
}

impl Figures {
    pub(super) fn new() -> Figures {
        let mut figures = Figures {
            registry: Registry::with_prefix("leeward"),
            began: Instant::now(),
            requests: Family::default(),
            patches: Counter::default(),
            patch_s: Histogram::new(PATCH_S),
            revision: Gauge::default(),
            drones: Gauge::default(),
            up_s: Gauge::default(),
            connections: Gauge::default(),
            waiting: Gauge::default(),
            listeners: Gauge::default(),
            dropped: Counter::default(),
        };
        let registry = &mut figures.registry;
        let requests = figures.requests.clone();
        let help = "Requests answered, by method (`none`: it could not be read) and code of the error (`ok`: none)";
        registry.register("requests", help, requests);
        let patches = figures.patches.clone();
        registry.register("patches", "Patches, each verified", patches);
        let help = "How long a request took that gave a patch, without its time in the queue";
        registry.register("patch_seconds", help, figures.patch_s.clone());
        let revision = figures.revision.clone();
        registry.register("revision", "Of the plan; 0: none is open", revision);
        registry.register(
            "drones",
            "Of the plan; 0: none is open",
            figures.drones.clone(),
        );
        registry.register(
            "up_seconds",
            "Since the process began",
            figures.up_s.clone(),
        );
        let connections = figures.connections.clone();
        registry.register("connections", "Open connections", connections);
        let waiting = figures.waiting.clone();
        registry.register("waiting", "Requests that wait or are worked on", waiting);
        let listeners = figures.listeners.clone();
        registry.register("listeners", "Clients that listen to events", listeners);
        let help = "Clients that listened to events and did not read them";
        registry.register("listeners_dropped", help, figures.dropped.clone());
        figures
    }

    /// Counts an answer.
    pub(super) fn answered(&self, method: &'static str, code: &str) {
        let labels = vec![("method", method.to_owned()), ("code", code.to_owned())];
        self.requests.get_or_create(&labels).inc();
    }

    /// Counts a patch that took so long.
    pub(super) fn patched(&self, took: Duration) {
        self.patches.inc();
        self.patch_s.observe(took.as_secs_f64());
    }

    /// All of them as text.
    pub(super) fn text(&self) -> String {
        self.up_s.set(self.began.elapsed().as_secs_f64());
        let mut text = String::new();
        // Nothing but writing to a text, which does not fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}
