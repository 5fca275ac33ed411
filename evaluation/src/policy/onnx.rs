//! A policy in an ONNX file, computed by ONNX Runtime.
//!
//! The library is loaded when a policy is opened: the file that `ORT_DYLIB_PATH` names, else `libonnxruntime.so` where the system
//! looks for libraries.

use super::fit::Moments;
use super::packed::{Array, entry};
use ort::logging::LogLevel;
use ort::session::Session;
use ort::value::{DynValue, Tensor, TensorElementType, ValueType};
use rmpv::Value;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

const LIBRARY: &str = "ORT_DYLIB_PATH";
/// Of a byte of a picture, when an input takes real numbers: 0 to 1, as torch's pictures.
const OF_A_BYTE: f32 = 1.0 / 255.0;

/// A policy in a file cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum OnnxError {
    /// No library.
    #[error(
        "ONNX Runtime cannot be loaded ({0}); `pip install onnxruntime`, then set {LIBRARY} to libonnxruntime.so.VERSION in its folder onnxruntime/capi"
    )]
    Library(String),
    /// The file.
    #[error("{} is no policy that can be computed: {what}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        what: String,
    },
    /// One of its answers.
    #[error("the policy of {} answered with {what}", path.display())]
    Answer {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// An input of the network.
#[derive(Debug)]
struct Input {
    name: String,
    element: TensorElementType,
    axes: Vec<Option<usize>>,
    moments: Moments,
}

/// A policy in a file.
#[derive(Debug)]
pub struct Onnx {
    path: PathBuf,
    session: Session,
    inputs: Vec<Input>,
    output: String,
}

impl Onnx {
    /// Opens a file. Actions are its output `action` or `actions`, or its only one.
    ///
    /// # Errors
    /// [`OnnxError::Library`]; [`OnnxError::File`] of what is no model, or one with inputs or outputs that no policy has.
    pub fn open(path: &Path) -> Result<Self, OnnxError> {
        let bad = |what: String| OnnxError::File { path: path.to_owned(), what };
        if !path.is_file() {
            return Err(bad("there is no such file; give the path of a model that was exported to ONNX".into()));
        }
        let library = std::env::var_os(LIBRARY).unwrap_or_else(|| "libonnxruntime.so".into());
        let environment = ort::init_from(&library).map_err(|error| OnnxError::Library(line(&error)))?;
        // The first of a process counts, and none of them asks for anything.
        let _first = environment.commit();
        let session = Session::builder()
            .and_then(|builder| Ok(builder.with_log_level(LogLevel::Error)?))
            .and_then(|mut builder| builder.commit_from_file(path))
            .map_err(|error| bad(format!("{}; export it again, with an opset that ONNX Runtime has", line(&error))))?;
        let inputs = session.inputs().iter().map(|input| Input::of(input.name(), input.dtype()));
        let inputs = inputs.collect::<Result<Vec<_>, _>>().map_err(bad)?;
        let outputs: Vec<&str> = session.outputs().iter().map(ort::value::Outlet::name).collect();
        let output = match outputs[..] {
            [only] => Some(only),
            _ => outputs.iter().find(|name| matches!(**name, "action" | "actions")).copied(),
        };
        let output = output
            .map(str::to_owned)
            .ok_or_else(|| bad(format!("its outputs are {}; export it with one called action", outputs.join(", "))))?;
        Ok(Self { path: path.to_owned(), session, inputs, output })
    }

    /// An episode begins: what was seen before is forgotten.
    pub fn begin(&mut self) {
        self.inputs.iter_mut().for_each(|input| input.moments.clear());
    }

    /// The next actions, a row each.
    ///
    /// # Errors
    /// [`OnnxError::File`] when an input is not among what is seen, or has another shape; [`OnnxError::Answer`].
    pub fn actions(&mut self, observation: &Value) -> Result<Vec<Vec<f32>>, OnnxError> {
        let mut values: Vec<(String, DynValue)> = Vec::new();
        for input in &mut self.inputs {
            let value = input.value(observation).map_err(|what| OnnxError::File {
                path: self.path.clone(),
                what: format!("its input {} {what}", input.name),
            })?;
            values.push((input.name.clone(), value));
        }
        let answer = |what: String| OnnxError::Answer { path: self.path.clone(), what };
        let found = self.session.run(values).map_err(|error| answer(format!("an error: {}", line(&error))))?;
        let output = found.get(&self.output).ok_or_else(|| answer("no actions".into()))?;
        let (shape, values) = output
            .try_extract_tensor::<f32>()
            .map_err(|_| answer(format!("{}, which are no float32; export it with such an output", self.output)))?;
        let mut shape: Vec<usize> = shape.iter().map(|length| usize::try_from(*length).unwrap_or(0)).collect();
        if let [1, _, _] = shape[..] {
            shape.remove(0);
        }
        Array { shape, values: values.to_vec() }.rows().map_err(|error| answer(error.to_string()))
    }

    /// An answer that does not fit the task.
    #[must_use]
    pub fn answer(&self, what: &dyn std::fmt::Display) -> OnnxError {
        OnnxError::Answer { path: self.path.clone(), what: what.to_string() }
    }
}

impl Input {
    fn of(name: &str, kind: &ValueType) -> Result<Self, String> {
        let (Some(element), Some(shape)) = (kind.tensor_type(), kind.tensor_shape()) else {
            return Err(format!("its input {name} is no tensor; export a policy whose inputs are tensors"));
        };
        if !matches!(element, TensorElementType::Float32 | TensorElementType::Uint8) {
            return Err(format!("its input {name} takes {element}; export it with float32, or uint8 for pictures"));
        }
        let axes = shape.iter().map(|length| usize::try_from(*length).ok()).collect();
        Ok(Self { name: name.to_owned(), element, axes, moments: Moments::default() })
    }

    fn value(&mut self, observation: &Value) -> Result<DynValue, String> {
        let seen = entry(observation, &self.name).or_else(|| entry(observation, &key(&self.name)));
        let seen = seen.ok_or_else(|| {
            let names: Vec<&str> =
                observation.as_map().into_iter().flatten().filter_map(|(name, _)| name.as_str()).collect();
            format!("is none of {}; say which it is with --key OURS={}", names.join(", "), self.name)
        })?;
        let seen = Array::read(seen).map_err(|error| format!("cannot be filled: {error}"))?;
        let real = self.element == TensorElementType::Float32;
        let scale = if real && seen.shape.len() == 3 { OF_A_BYTE } else { 1.0 };
        let filled = self.moments.fill(&seen, &self.axes, scale)?;
        let value = if real {
            Tensor::from_array((filled.shape, filled.values)).map(Tensor::into_dyn)
        } else {
            let bytes: Vec<u8> = filled.values.iter().map(|value| *value as u8).collect();
            Tensor::from_array((filled.shape, bytes)).map(Tensor::into_dyn)
        };
        value.map_err(|error| format!("cannot be filled: {}", line(&error)))
    }
}

/// Our key of LeRobot's name of a feature.
fn key(name: &str) -> Cow<'_, str> {
    match name.strip_prefix("observation.images.") {
        Some(camera) => match camera.strip_suffix("_depth") {
            Some(camera) => format!("observation/depth/{camera}").into(),
            None => format!("observation/image/{camera}").into(),
        },
        None => name.replace("observation.", "observation/").into(),
    }
}

/// What happened, in one line.
fn line(error: &dyn std::fmt::Display) -> String {
    let words = error.to_string();
    words.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}
