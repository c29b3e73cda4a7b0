//! The mean airflow below hovering multirotors.
