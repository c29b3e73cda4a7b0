//! A drone's light program, as a show file has it: kept as it is, never made.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;

/// Skybrush's light program, version 1: its bytecode counts from the show's beginning.
#[derive(Clone, Debug, PartialEq)]
pub struct Lights {
    /// As the show file has it.
    json: Value,
    bytecode: Vec<u8>,
}

impl Lights {
    /// The program of a show file's `lights`.
    ///
    /// # Errors
    ///
    /// Another version, or data that are no base64.
    pub fn of(json: Value) -> Result<Lights, String> {
        if json["version"] != 1 {
            let version = &json["version"];
            return Err(format!("lights of version {version}, this program reads 1"));
        }
        let data = json["data"].as_str().ok_or("lights without `data`")?;
        let bytecode = BASE64_STANDARD.decode(data);
        let bytecode = bytecode.map_err(|error| format!("lights, `data`: {error}"))?;
        Ok(Lights { json, bytecode })
    }

    /// As the show file has it.
    #[must_use]
    pub fn json(&self) -> &Value {
        &self.json
    }

    /// As a binary show file has it.
    #[must_use]
    pub fn bytecode(&self) -> &[u8] {
        &self.bytecode
    }
}
