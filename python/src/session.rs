//! Sessions and clips.

use crate::arrays::{list, rows};
use crate::failed;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use shared_mem::cell::ClipKind;
use shared_mem::recording;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A folder with cell.toml and clips, or one clip beside a cell.toml.
#[pyclass(frozen, module = "twinalign")]
pub(crate) struct Session {
    inner: recording::Session,
}

#[pymethods]
impl Session {
    /// Opens a session folder; `cell`: another cell.toml than the one beside the clips; `object`: of several the one whose poses a
    /// clip's `object_position` and `object_orientation` are, else the first.
    #[new]
    #[pyo3(signature = (path, *, cell=None, object=None))]
    fn new(path: PathBuf, cell: Option<PathBuf>, object: Option<String>) -> PyResult<Self> {
        let mut inner = recording::Session::open_with(&path, cell.as_deref()).map_err(failed)?;
        if let Some(name) = object {
            inner.cell.about(&name).map_err(failed)?;
        }
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
    /// Of the other objects of cell.toml, by name: stamps [poses], ns, positions [poses, 3], m, and quaternions [poses, 4].
    others: BTreeMap<String, Poses>,
    /// What was found odd in it, one sentence each.
    warnings: Vec<String>,
}

/// Stamps, positions and quaternions of an object; the last two None where it was not tracked.
type Poses = (Py<PyArray1<u64>>, Option<Py<PyArray2<f64>>>, Option<Py<PyArray2<f64>>>);

fn poses(py: Python<'_>, series: recording::ObjectSeries) -> PyResult<Poses> {
    let places = series.poses.iter().flat_map(|pose| pose.position()).collect();
    let turns = series.poses.iter().flat_map(|pose| pose.wxyz()).collect();
    Ok((list(py, series.stamps_ns), rows(py, places, 3)?, rows(py, turns, 4)?))
}

#[pymethods]
impl Clip {
    fn __repr__(&self) -> String {
        format!("Clip({:?})", self.file.display().to_string())
    }
}

impl Clip {
    fn new(py: Python<'_>, clip: recording::Clip) -> PyResult<Self> {
        let recording::Clip {
            file, kind, joint_names, desired, measured, object, others, mut warnings, damage, ..
        } = clip;
        warnings.extend(damage);
        let kind = match kind {
            ClipKind::Excitation => "excitation",
            ClipKind::ControlHitSlide => "control_hit_slide",
            ClipKind::FreeMotion => "free_motion",
        };
        let (object_stamps_ns, object_position, object_orientation) = poses(py, object)?;
        let others = others.into_iter().map(|other| Ok((other.name, poses(py, other.series)?)));
        let others = others.collect::<PyResult<_>>()?;
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
            object_stamps_ns,
            object_position,
            object_orientation,
            others,
            warnings,
        })
    }
}
