//! `plan schema`: the scenario format as a JSON schema, with every default and every preset.

/// What `plan schema` prints: one JSON object, the schema for editors, with two lists for readers beside its
/// properties: `defaults`, by path, and `presets`.
pub(crate) fn schema() -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string_pretty(&planner::scenario::schema())?;
    text.push('\n');
    Ok(text)
}
