//! A policy in an ONNX file, computed by ONNX Runtime. `computed` owns the thread that does so, and its limits.
//!
//! The library is loaded when a policy is opened: the file that `ORT_DYLIB_PATH` names, else `libonnxruntime.so` where the system
//! looks for libraries.

mod computed;

use super::fit::Moments;
use super::packed::{Array, MOST_NUMBERS, Rows, entry};
use computed::{Computed, Given, Numbers, Port, Uncomputed};
use ort::value::TensorElementType;
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
    /// The end was asked for.
    #[error("interrupted")]
    Interrupted,
    /// One of its answers.
    #[error("the policy of {} answered with {what}", path.display())]
    Answer {
        /// Which.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// What helps where a network has no end.
const REMEDY: &str = "export the policy without its training, and with axes of the lengths that it uses";

/// The output that holds the actions.
fn output(ports: &[Port]) -> Result<String, String> {
    let is_action = |port: &&Port| matches!(port.name.as_str(), "action" | "actions");
    let chosen = if let [only] = ports { Some(only) } else { ports.iter().find(is_action) };
    let chosen = chosen.ok_or_else(|| {
        let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
        format!("its outputs are {}; export it with one called action", names.join(", "))
    })?;
    let known = chosen.kind.tensor_shape().into_iter().flat_map(|shape| shape.iter());
    let count = known.filter_map(|length| u64::try_from(*length).ok()).fold(1_u64, u64::saturating_mul);
    if count > MOST_NUMBERS as u64 {
        return Err(format!("its output {} has {count} numbers, and {MOST_NUMBERS} at most are taken", chosen.name));
    }
    Ok(chosen.name.clone())
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
    network: Computed,
    inputs: Vec<Input>,
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
        let network = Computed::open(path, output).map_err(|error| match error {
            Uncomputed::Failed(what) => bad(what),
            Uncomputed::Ended(what) => bad(format!("it {what}; {REMEDY}")),
            Uncomputed::Interrupted => OnnxError::Interrupted,
        })?;
        let inputs = network.inputs.iter().map(Input::of).collect::<Result<Vec<_>, _>>().map_err(bad)?;
        Ok(Self { path: path.to_owned(), network, inputs })
    }

    /// An episode begins: what was seen before is forgotten.
    pub fn begin(&mut self) {
        self.inputs.iter_mut().for_each(|input| input.moments.clear());
    }

    /// The next actions, a row each.
    ///
    /// # Errors
    /// [`OnnxError::File`] when an input is not among what is seen, or has another shape; [`OnnxError::Answer`].
    pub fn actions(&mut self, observation: &Value) -> Result<Rows, OnnxError> {
        let mut given = Vec::new();
        for input in &mut self.inputs {
            given.push(input.given(observation).map_err(|what| OnnxError::File {
                path: self.path.clone(),
                what: format!("its input {} {what}", input.name),
            })?);
        }
        let answer = |what: String| OnnxError::Answer { path: self.path.clone(), what };
        let mut found = self.network.run(given).map_err(|error| match error {
            Uncomputed::Failed(what) => answer(what),
            Uncomputed::Ended(what) => answer(format!("nothing: it {what}; {REMEDY}")),
            Uncomputed::Interrupted => OnnxError::Interrupted,
        })?;
        if let [1, _, _] = found.shape[..] {
            found.shape.remove(0);
        }
        found.into_rows().map_err(|error| answer(error.to_string()))
    }

    /// An answer that does not fit the task.
    pub fn answer(&self, what: &dyn std::fmt::Display) -> OnnxError {
        OnnxError::Answer { path: self.path.clone(), what: what.to_string() }
    }
}

impl Input {
    fn of(Port { name, kind }: &Port) -> Result<Self, String> {
        let (Some(element), Some(shape)) = (kind.tensor_type(), kind.tensor_shape()) else {
            return Err(format!("its input {name} is no tensor; export a policy whose inputs are tensors"));
        };
        if !matches!(element, TensorElementType::Float32 | TensorElementType::Uint8) {
            return Err(format!("its input {name} takes {element}; export it with float32, or uint8 for pictures"));
        }
        let axes = shape.iter().map(|length| usize::try_from(*length).ok()).collect();
        Ok(Self { name: name.clone(), element, axes, moments: Moments::default() })
    }

    fn given(&mut self, observation: &Value) -> Result<Given, String> {
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
        let numbers = if real {
            Numbers::Real(filled.values)
        } else {
            Numbers::Bytes(filled.values.iter().map(|value| *value as u8).collect())
        };
        Ok(Given { name: self.name.clone(), shape: filled.shape, numbers })
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
