//! A training on its way or at its end, in a file: whole or not there, and only for the same cloud, photographs and settings.

use super::adam::Moments;
use super::{Photograph, Settings};
use crate::cloud::SplatCloud;
use crate::gradient::Parameters;
use shared_mem::checksum::{with_checksum, without_checksum};
use shared_mem::input::{self, InputError};
use shared_mem::output::{self, OutputError};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};

/// The state of a training cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// It cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// It belongs to other photographs, another cloud or other settings, or is damaged.
    #[error("{} holds the state of another training, or is damaged: remove it to begin anew", .0.display())]
    Other(PathBuf),
}

const MAGIC: &[u8; 8] = b"splats 2";
/// Magic, mark, step.
const HEAD: usize = 24;

/// What a training is known by.
pub(super) fn mark(cloud: &SplatCloud, photographs: &[Photograph], settings: &Settings) -> u64 {
    let mut hasher = DefaultHasher::new();
    Parameters::<f32>::of(cloud).columns().concat().iter().for_each(|value| value.to_bits().hash(&mut hasher));
    for photograph in photographs {
        format!("{:?} {:?}", photograph.camera, photograph.size).hash(&mut hasher);
        photograph.rgb.hash(&mut hasher);
        photograph.mask.hash(&mut hasher);
        photograph.depth.iter().flatten().for_each(|value| value.to_bits().hash(&mut hasher));
    }
    format!("{:?}", Settings { state: None, ..settings.clone() }).hash(&mut hasher);
    hasher.finish()
}

/// The state in a file; `None` where there is none.
pub(super) fn read(path: &Path, mark: u64, cloud: &SplatCloud) -> Result<Option<Moments>, StateError> {
    if !path.exists() {
        return Ok(None);
    }
    let bytes = input::bytes(path, input::Kind::Splats)?;
    parse(&bytes, mark, cloud).map(Some).ok_or_else(|| StateError::Other(path.to_owned()))
}

fn parse(bytes: &[u8], mark: u64, cloud: &SplatCloud) -> Option<Moments> {
    let (head, numbers) = without_checksum(bytes)?.split_at_checked(HEAD)?;
    let word = |at: usize| Some(u64::from_le_bytes(head.get(at..at + 8)?.try_into().ok()?));
    if !head.starts_with(MAGIC) || word(8)? != mark {
        return None;
    }
    let mut moments = Moments::new(Parameters::of(cloud));
    moments.step = usize::try_from(word(16)?).ok()?;
    let mut numbers = numbers.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
    for part in [&mut moments.at, &mut moments.mean, &mut moments.square] {
        for value in part.columns_mut().into_iter().flatten() {
            *value = numbers.next()?;
        }
    }
    let is_whole = numbers.next().is_none() && numbers.len() == 0;
    is_whole.then_some(moments)
}

/// Keeps a state.
pub(super) fn write(path: &Path, mark: u64, moments: &Moments) -> Result<(), StateError> {
    let mut bytes = [&MAGIC[..], &mark.to_le_bytes(), &(moments.step as u64).to_le_bytes()].concat();
    for part in [&moments.at, &moments.mean, &moments.square] {
        part.columns().into_iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    Ok(output::write(path, with_checksum(bytes))?)
}
