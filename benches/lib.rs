//! Benchmarks of the workspace: `cargo bench --bench NAME`. Each file asks a question and says its
//! answer.
