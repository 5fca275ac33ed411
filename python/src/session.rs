//! Sessions and clips.

use crate::arrays::{list, rows};
use crate::failed;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use shared_mem::cell::ClipKind;
use shared_mem::recording;
use std::path::PathBuf;

/// A folder with cell.toml and clips, or one clip beside a cell.toml.
#[pyclass(frozen, module = "twinalign")]
pub(crate) struct Session {
    inner: recording::Session,
}

#[pymethods]
impl Session {
    /// Opens a session folder; `cell`: another cell.toml than the one beside the clips.
    #[new]
    #[pyo3(signature = (path, *, cell=None))]
    fn new(path: PathBuf, cell: Option<PathBuf>) -> PyResult<Self> {
        let inner = recording::Session::open_with(&path, cell.as_deref()).map_err(failed)?;
        Ok(Self { inner })
    }

    /// The session's folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.inner.folder.clone()
    }

    /// cell.toml as it stands there, as TOML.
    #[getter]
    fn cell_toml(&self) -> String {
        self.inner.cell.to_toml()
    }

    /// Names of the clips' files, in the order of cell.toml.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.inner.clips.iter().map(|clip| clip.file.clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.inner.clips.len()
    }

    /// Reads a clip.
    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<Clip> {
        let count = self.inner.clips.len();
        let from_end = if index < 0 { index + count as isize } else { index };
        let entry = usize::try_from(from_end).ok().and_then(|index| self.inner.clips.get(index));
        let entry = entry.ok_or_else(|| PyIndexError::new_err(format!("there are {count} clips")))?;
        let clip = py.detach(|| self.inner.read(entry)).map_err(failed)?;
        Clip::new(py, clip)
    }

    fn __repr__(&self) -> String {
        format!("Session({:?}, {} clips)", self.inner.folder.display().to_string(), self.inner.clips.len())
    }
}

/// One recorded motion. SI units; stamps in ns; what was not logged is None.
#[pyclass(frozen, get_all, module = "twinalign")]
pub(crate) struct Clip {
    /// Its file.
    file: PathBuf,
    /// excitation, control_hit_slide or free_motion.
    kind: &'static str,
    /// Names of the joints, in the order of all columns.
    joint_names: Vec<String>,
    /// Stamps of what was measured [rows], ns.
    stamps_ns: Py<PyArray1<u64>>,
    /// Measured positions [rows, joints], rad.
    q: Option<Py<PyArray2<f64>>>,
    /// Measured velocities [rows, joints], rad/s.
    dq: Option<Py<PyArray2<f64>>>,
    /// Measured torques behind the gears, gravity included [rows, joints], N m.
    #[pyo3(name = "tau_J")]
    tau: Option<Py<PyArray2<f64>>>,
    /// Stamps of the commands [rows], ns.
    command_stamps_ns: Py<PyArray1<u64>>,
    /// Desired positions [rows, joints], rad.
    q_d: Option<Py<PyArray2<f64>>>,
    /// Desired velocities [rows, joints], rad/s.
    dq_d: Option<Py<PyArray2<f64>>>,
    /// Desired torques without gravity [rows, joints], N m.
    #[pyo3(name = "tau_J_d")]
    tau_d: Option<Py<PyArray2<f64>>>,
    /// Stamps of the object's poses [poses], ns.
    object_stamps_ns: Py<PyArray1<u64>>,
    /// Geometric centre of the object in the base frame [poses, 3], m.
    object_position: Option<Py<PyArray2<f64>>>,
    /// The object's quaternions w, x, y, z in the base frame [poses, 4].
    object_orientation: Option<Py<PyArray2<f64>>>,
    /// What was found odd in it, one sentence each.
    warnings: Vec<String>,
}

#[pymethods]
impl Clip {
    fn __repr__(&self) -> String {
        format!("Clip({:?})", self.file.display().to_string())
    }
}

impl Clip {
    fn new(py: Python<'_>, clip: recording::Clip) -> PyResult<Self> {
        let recording::Clip { file, kind, joint_names, desired, measured, object, mut warnings, damage, .. } = clip;
        warnings.extend(damage);
        let kind = match kind {
            ClipKind::Excitation => "excitation",
            ClipKind::ControlHitSlide => "control_hit_slide",
            ClipKind::FreeMotion => "free_motion",
        };
        let places = object.poses.iter().flat_map(|pose| pose.position()).collect();
        let turns = object.poses.iter().flat_map(|pose| pose.wxyz()).collect();
        Ok(Self {
            file,
            kind,
            joint_names,
            stamps_ns: list(py, measured.stamps_ns),
            q: rows(py, measured.q, measured.dof)?,
            dq: rows(py, measured.dq, measured.dof)?,
            tau: rows(py, measured.tau, measured.dof)?,
            command_stamps_ns: list(py, desired.stamps_ns),
            q_d: rows(py, desired.q, desired.dof)?,
            dq_d: rows(py, desired.dq, desired.dof)?,
            tau_d: rows(py, desired.tau, desired.dof)?,
            object_stamps_ns: list(py, object.stamps_ns),
            object_position: rows(py, places, 3)?,
            object_orientation: rows(py, turns, 4)?,
            warnings,
        })
    }
}
