//! What a question is made of, as one number: by content, whatever the files are called from where.

use shared_mem::cell::Cell;
use shared_mem::command_line;
use shared_mem::input;
use shared_mem::recording::Clip;
use std::hash::{DefaultHasher, Hash, Hasher as _};

/// What a question is made of, as one number.
#[derive(Debug, Clone)]
pub struct Fingerprint(DefaultHasher);

impl Fingerprint {
    /// Of a command, in this build of the program.
    pub fn of(command: &str) -> Self {
        Self::in_build(command, command_line::fingerprint())
    }

    pub(super) fn in_build(command: &str, build: &str) -> Self {
        let mut hasher = DefaultHasher::new();
        (command, env!("CARGO_PKG_VERSION"), build).hash(&mut hasher);
        Self(hasher)
    }

    /// With a setting.
    pub fn with(mut self, setting: &impl Hash) -> Self {
        setting.hash(&mut self.0);
        self
    }

    /// With numbers, to the last bit.
    pub fn with_numbers<'a>(mut self, numbers: impl IntoIterator<Item = &'a f64>) -> Self {
        let mut count = 0_usize;
        for number in numbers {
            self.0.write_u64(number.to_bits());
            count += 1;
        }
        // Without it two lists would be one with the same numbers.
        self.0.write_usize(count);
        self
    }

    /// With a cell: its numbers, and what the descriptions and meshes hold that it names.
    pub fn with_cell(self, cell: &Cell) -> Self {
        let robot = cell.robot.iter().filter_map(|robot| robot.urdf.as_ref());
        let objects = cell.objects.iter().flat_map(|object| [&object.mesh, &object.urdf]).flatten();
        let numbers = self.with(&(cell.to_toml(), cell.in_question));
        robot.chain(objects).fold(numbers, |print, file| {
            // What cannot be read is refused by who needs it.
            print.with(&input::bytes(&cell.folder.join(file), input::Kind::Mesh).ok())
        })
    }

    /// With the rows of clips, to the last bit, and their names; not with where they lie.
    pub fn with_clips<'a>(self, clips: impl IntoIterator<Item = &'a Clip>) -> Self {
        clips.into_iter().fold(self, |print, clip| {
            let name = clip.file.file_name();
            let print = print.with(&(name, clip.torques_end_at_rows, format!("{:?}", clip.kind)));
            let print = [&clip.measured, &clip.desired].into_iter().fold(print, |print, series| {
                print.with(&series.stamps_ns).with_numbers(series.q.iter().chain(&series.dq).chain(&series.tau))
            });
            let poses = clip.object.poses.iter().flat_map(|pose| {
                let ([x, y, z], [w, i, j, k]) = (pose.position(), pose.wxyz());
                [x, y, z, w, i, j, k]
            });
            print.with(&clip.object.stamps_ns).with_numbers(&poses.collect::<Vec<f64>>())
        })
    }

    pub fn number(&self) -> u64 {
        self.0.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::ClipKind;
    use shared_mem::origin::Origins;
    use shared_mem::recording::{JointSeries, ObjectSeries};
    use std::path::Path;

    #[test]
    fn a_session_is_the_same_however_it_is_spelt_and_another_one_with_other_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "[robot]\nurdf = \"arm.urdf\"\n";
        std::fs::write(folder.path().join("cell.toml"), text).expect("room");
        std::fs::write(folder.path().join("arm.urdf"), "<robot name=\"one\"/>").expect("room");
        let elsewhere = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(folder.path(), elsewhere.path().join("session")).expect("a link");
        let question = |session: &Path| {
            let cell = Cell::read(&session.join("cell.toml")).expect("a cell");
            let clip = Clip {
                file: session.join("clip_00.mcap"),
                kind: ClipKind::Excitation,
                joint_names: Vec::new(),
                desired: JointSeries::default(),
                measured: JointSeries::default(),
                torques_end_at_rows: false,
                object: ObjectSeries::default(),
                others: Vec::new(),
                origins: Origins::default(),
                warnings: Vec::new(),
                damage: None,
            };
            Fingerprint::of("one").with_cell(&cell).with_clips([&clip]).number()
        };
        let spelt = question(folder.path());
        let roundabout = folder.path().join("..").join(folder.path().file_name().expect("a name"));
        assert_eq!((spelt, spelt), (question(&roundabout), question(&elsewhere.path().join("session"))));
        std::fs::write(folder.path().join("arm.urdf"), "<robot name=\"two\"/>").expect("room");
        assert_ne!(spelt, question(folder.path()));
    }
}
