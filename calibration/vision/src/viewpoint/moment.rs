//! What belongs to a picture: where the joints stood, and the camera where the file says it.

use anyhow::{Context as _, bail};
use serde_json::Value;
use shared_mem::budget::Budget;
use shared_mem::input;
use shared_mem::json;
use shared_mem::lens::calibration::Calibration;
use std::path::Path;

/// Joint positions and, where the file tells it, the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Joint positions [rad].
    pub q: Vec<f64>,
    pub camera: Option<Calibration>,
}

impl Moment {
    /// From numbers with commas between them, or from a JSON file: a list of joint positions, or an object with `q`, or
    /// with `states` (each with `q`) and `nearest_state_index`; beside them the camera as ROS names it (`K`, `D`,
    /// `distortion_model`, `width`, `height`).
    ///
    /// # Errors
    /// When it is neither, with what was expected.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
        if let Ok(q) = numbers {
            return Ok(Self { q, camera: None });
        }
        let file = input::bytes(Path::new(text), input::Kind::List)
            .with_context(|| format!("{text} is neither numbers with commas between them nor a readable JSON file"))?;
        let value = json::read::<Value>(&file, &Budget::of(file.len() as u64));
        let value = value.map_err(|what| anyhow::anyhow!("{text} {what}"))?;
        let numbers = |value: &Value| -> Option<Vec<f64>> { value.as_array()?.iter().map(Value::as_f64).collect() };
        let at = value.get("nearest_state_index").and_then(Value::as_u64).unwrap_or(0) as usize;
        let state = value.get("states").and_then(|states| states.get(at));
        let q = numbers(&value).or_else(|| numbers(value.get("q")?)).or_else(|| numbers(state?.get("q")?));
        let Some(q) = q else { bail!("{text} holds no joint positions: give a list of numbers or an object with `q`") };
        let camera = value.as_object().map_or(Ok(None), Calibration::of);
        Ok(Self { q, camera: camera.map_err(|what| anyhow::anyhow!("{text}: {what}"))? })
    }
}
