//! Synthetic recordings with injected effects, and the metrics of a diagnosis that was not told which; the command alone uses them.
