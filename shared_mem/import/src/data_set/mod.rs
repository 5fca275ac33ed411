//! Writes LeRobot data sets (version 3.0), as LeRobot 0.6 reads them: numbers in single precision, pictures as PNG inside the
//! parquet files, depth as PNG of 16 bits in millimetres. [`crate::import`] reads their numbers back.
//!
//! | file | owns |
//! |---|---|
//! | `table` | parquet files |
//! | `statistics` | least, largest, mean, deviation and quantiles of each feature |

mod statistics;
mod table;

use serde_json::{Map, Value, json};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::output::{OutputError, OutputFolder};
use shared_mem::recording::pack_picture;
use statistics::Statistics;
use std::path::PathBuf;
use table::{Column, Kind, TableFile, Values};

/// A data file that holds this much is followed by another one [bytes], as LeRobot's own; files in a chunk.
const FILE_SIZE: u64 = 100 << 20;
const CHUNK: usize = 1000;

/// What a data set is about.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSetPlan {
    /// Frames a second.
    pub rate: u32,
    /// What kind of robot it is of.
    pub robot: String,
    /// What is done, in words.
    pub task: String,
    /// What each frame holds.
    pub features: Vec<Feature>,
}

/// One of the things that each frame holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// `observation.state`, `action`, `observation.images.front`.
    pub name: String,
    /// What kind of thing it is.
    pub kind: FeatureKind,
}

/// What kind of thing a feature is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FeatureKind {
    /// Numbers, by their names.
    Numbers(Vec<String>),
    /// Pictures of so many columns and rows, in colour or of depth in millimetres.
    Pictures(PixelEncoding, [u32; 2]),
}

/// A feature of all frames of an episode.
#[derive(Debug, Clone, PartialEq)]
pub enum Frames {
    /// Row by row, as many a row as there are names.
    Numbers(Vec<f32>),
    /// Pixels without gaps between rows.
    Pictures(Vec<Vec<u8>>),
}

/// A data set cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum DataSetError {
    /// The disk refuses.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A parquet file cannot be written.
    #[error("{}: cannot be written ({what}); free some space and export again", file.display())]
    Table {
        /// Which one, in the data set.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// An episode is not as the plan says.
    #[error("`{feature}`: {what}; export episodes of one task")]
    Shape {
        feature: String,
        /// What is wrong.
        what: String,
    },
}

/// A data set that is being written; it is there when it is finished, or not at all.
#[derive(Debug)]
pub struct DataSetWriter {
    folder: OutputFolder,
    plan: DataSetPlan,
    /// The open data file.
    data: Option<TableFile>,
    files: usize,
    episodes: Vec<EpisodeRow>,
    frames: usize,
    statistics: Vec<(String, Statistics)>,
}

/// Where an episode is.
#[derive(Debug, Clone, Copy)]
struct EpisodeRow {
    file: usize,
    begin: usize,
    end: usize,
}

/// Columns that count and tell the time, behind the features.
const COUNTERS: [&str; 4] = ["frame_index", "episode_index", "index", "task_index"];
const TIMESTAMP: &str = "timestamp";

impl DataSetWriter {
    /// Begins a data set in a new folder.
    pub fn new(folder: OutputFolder, plan: DataSetPlan) -> Self {
        let of = |feature: &Feature| match &feature.kind {
            FeatureKind::Numbers(names) => Statistics::of_numbers(names.len()),
            FeatureKind::Pictures(encoding, _) => Statistics::of_pictures(*encoding),
        };
        let mut statistics: Vec<_> = plan.features.iter().map(|f| (f.name.clone(), of(f))).collect();
        let counters = [TIMESTAMP].into_iter().chain(COUNTERS);
        statistics.extend(counters.map(|name| (name.to_owned(), Statistics::of_numbers(1))));
        Self { folder, plan, data: None, files: 0, episodes: Vec::new(), frames: 0, statistics }
    }

    /// Adds an episode: one [`Frames`] for each feature of the plan.
    ///
    /// # Errors
    /// [`DataSetError`]; the data set is of no use then.
    pub fn episode(&mut self, frames: &[Frames]) -> Result<(), DataSetError> {
        let count = self.frames_in(frames)?;
        let (begin, episode) = (self.frames, self.episodes.len());
        let times: Vec<f32> = (0..count).map(|k| (k as f64 / f64::from(self.plan.rate)) as f32).collect();
        let long = |value: usize| i64::try_from(value).unwrap_or(i64::MAX);
        let counters: [Vec<i64>; 4] = [
            (0..count).map(long).collect(),
            vec![long(episode); count],
            (begin..begin + count).map(long).collect(),
            vec![0; count],
        ];
        let mut packed = Vec::new();
        for (feature, frames) in self.plan.features.iter().zip(frames) {
            packed.push(packed_frames(feature, frames)?);
        }
        for ((_, statistics), frames) in self.statistics.iter_mut().zip(frames) {
            match frames {
                Frames::Numbers(values) => values.iter().for_each(|value| statistics.number(f64::from(*value))),
                Frames::Pictures(pictures) => pictures.iter().for_each(|pixels| statistics.picture(pixels)),
            }
        }
        let counted = self.statistics[frames.len()..].iter_mut().map(|(_, statistics)| statistics);
        let time = times.iter().map(|time| f64::from(*time)).collect();
        let numbers =
            [time].into_iter().chain(counters.iter().map(|c| c.iter().map(|v| *v as f64).collect::<Vec<_>>()));
        for (statistics, numbers) in counted.zip(numbers) {
            numbers.into_iter().for_each(|value| statistics.number(value));
        }
        let mut values: Vec<Values<'_>> = packed.iter().map(Packed::values).collect();
        values.push(Values::Floats(&times));
        values.extend(counters.iter().map(|counter| Values::Longs(counter)));
        self.data_file()?.rows(&values)?;
        self.frames += count;
        self.episodes.push(EpisodeRow { file: self.files - 1, begin, end: self.frames });
        Ok(())
    }

    /// How many frames an episode has.
    fn frames_in(&self, frames: &[Frames]) -> Result<usize, DataSetError> {
        let mut count = None;
        for (feature, frames) in self.plan.features.iter().zip(frames) {
            let (has, fits) = match (&feature.kind, frames) {
                (FeatureKind::Numbers(names), Frames::Numbers(values)) => {
                    let width = names.len().max(1);
                    (values.len() / width, values.len() % width == 0)
                }
                (FeatureKind::Pictures(encoding, [width, height]), Frames::Pictures(pictures)) => {
                    let size = width * height * encoding.bytes_per_pixel();
                    (pictures.len(), pictures.iter().all(|pixels| pixels.len() == size as usize))
                }
                _ => (0, false),
            };
            if !fits || has == 0 || *count.get_or_insert(has) != has {
                let what = format!("an episode has {has} frames of it that do not fit the others or the data set");
                return Err(DataSetError::Shape { feature: feature.name.clone(), what });
            }
        }
        Ok(count.unwrap_or(0))
    }

    fn data_file(&mut self) -> Result<&mut TableFile, DataSetError> {
        if self.data.as_ref().is_some_and(|file| file.bytes() >= FILE_SIZE) {
            self.data.take().map_or(Ok(()), TableFile::finish)?;
        }
        if self.data.is_none() {
            let mut columns: Vec<Column> = self
                .plan
                .features
                .iter()
                .map(|feature| {
                    let kind = match &feature.kind {
                        FeatureKind::Numbers(names) if names.len() == 1 => Kind::Float,
                        FeatureKind::Numbers(_) => Kind::FloatList,
                        FeatureKind::Pictures(..) => Kind::Picture,
                    };
                    Column { name: feature.name.clone(), kind }
                })
                .collect();
            columns.push(Column { name: TIMESTAMP.into(), kind: Kind::Float });
            columns.extend(COUNTERS.map(|name| Column { name: name.into(), kind: Kind::Long }));
            let name = format!("data/chunk-{:03}/file-{:03}.parquet", self.files / CHUNK, self.files % CHUNK);
            self.files += 1;
            self.data = Some(TableFile::begin(&self.folder, &name, &columns, None)?);
        }
        self.data.as_mut().ok_or_else(|| DataSetError::Shape { feature: "data".into(), what: "no file is open".into() })
    }

    /// Completes the data set: episodes, tasks, statistics, and what is in it.
    ///
    /// # Errors
    /// [`DataSetError`]; nothing of it is there then.
    pub fn finish(mut self) -> Result<(), DataSetError> {
        self.data.take().map_or(Ok(()), TableFile::finish)?;
        self.write_episodes()?;
        self.write_tasks()?;
        let statistics: Map<String, Value> =
            self.statistics.iter_mut().map(|(name, statistics)| (name.clone(), statistics.json())).collect();
        let pretty = |value: &Value| format!("{value:#}\n").into_bytes();
        self.folder.write("meta/stats.json".as_ref(), &pretty(&statistics.into()))?;
        self.folder.write("meta/info.json".as_ref(), &pretty(&self.info()))?;
        self.folder.finish("meta")?;
        Ok(())
    }

    fn write_episodes(&self) -> Result<(), DataSetError> {
        let long = |of: &dyn Fn(&EpisodeRow) -> usize| -> Vec<i64> {
            self.episodes.iter().map(|row| i64::try_from(of(row)).unwrap_or(i64::MAX)).collect()
        };
        let numbers: [(&str, Vec<i64>); 8] = [
            ("episode_index", (0..).take(self.episodes.len()).collect()),
            ("length", long(&|row| row.end - row.begin)),
            ("data/chunk_index", long(&|row| row.file / CHUNK)),
            ("data/file_index", long(&|row| row.file % CHUNK)),
            ("dataset_from_index", long(&|row| row.begin)),
            ("dataset_to_index", long(&|row| row.end)),
            ("meta/episodes/chunk_index", vec![0; self.episodes.len()]),
            ("meta/episodes/file_index", vec![0; self.episodes.len()]),
        ];
        let mut columns = vec![Column { name: "tasks".into(), kind: Kind::TextList }];
        columns.extend(numbers.iter().map(|(name, _)| Column { name: (*name).into(), kind: Kind::Long }));
        let tasks = vec![self.plan.task.as_str(); self.episodes.len()];
        let mut values = vec![Values::Texts(&tasks)];
        values.extend(numbers.iter().map(|(_, values)| Values::Longs(values)));
        let name = "meta/episodes/chunk-000/file-000.parquet";
        let mut file = TableFile::begin(&self.folder, name, &columns, None)?;
        file.rows(&values)?;
        file.finish()
    }

    /// LeRobot reads it by pandas, which takes the index out of a record of its own.
    fn write_tasks(&self) -> Result<(), DataSetError> {
        let column = |name: &str, pandas_type: &str, numpy_type: &str| json!({"name": name, "field_name": name, "pandas_type": pandas_type, "numpy_type": numpy_type, "metadata": null});
        let pandas = json!({
            "index_columns": ["task"],
            "column_indexes": [{"name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object",
                "metadata": {"encoding": "UTF-8"}}],
            "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
            "pandas_version": "2.2.0",
        });
        let columns =
            [Column { name: "task_index".into(), kind: Kind::Long }, Column { name: "task".into(), kind: Kind::Text }];
        let record = Some(("pandas", pandas.to_string()));
        let mut file = TableFile::begin(&self.folder, "meta/tasks.parquet", &columns, record)?;
        file.rows(&[Values::Longs(&[0]), Values::Texts(&[&self.plan.task])])?;
        file.finish()
    }

    fn info(&self) -> Value {
        let mut features: Map<String, Value> =
            self.plan.features.iter().map(|f| (f.name.clone(), described(f))).collect();
        features.insert(TIMESTAMP.into(), json!({"dtype": "float32", "shape": [1], "names": null}));
        features.extend(COUNTERS.map(|name| (name.into(), json!({"dtype": "int64", "shape": [1], "names": null}))));
        json!({
            "codebase_version": "v3.0",
            "robot_type": self.plan.robot,
            "total_episodes": self.episodes.len(),
            "total_frames": self.frames,
            "total_tasks": 1,
            "chunks_size": CHUNK,
            "data_files_size_in_mb": FILE_SIZE >> 20,
            "video_files_size_in_mb": 200,
            "fps": self.plan.rate,
            "splits": {"train": format!("0:{}", self.episodes.len())},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": null,
            "features": features,
        })
    }
}

fn described(feature: &Feature) -> Value {
    match &feature.kind {
        FeatureKind::Numbers(names) => json!({"dtype": "float32", "shape": [names.len()], "names": names}),
        FeatureKind::Pictures(encoding, [width, height]) => {
            let is_depth = *encoding == PixelEncoding::Depth16;
            let channels = if is_depth { 1 } else { 3 };
            let mut described = json!({
                "dtype": "image", "shape": [height, width, channels], "names": ["height", "width", "channels"],
            });
            if is_depth {
                described["info"] = json!({"is_depth_map": true, "depth_unit": "mm"});
            }
            described
        }
    }
}

/// A feature as it goes into the table.
enum Packed<'a> {
    Numbers(&'a [f32], usize),
    Pictures(Vec<Vec<u8>>),
}

impl Packed<'_> {
    fn values(&self) -> Values<'_> {
        match self {
            Self::Numbers(values, 1) => Values::Floats(values),
            Self::Numbers(values, width) => Values::FloatLists(values, *width),
            Self::Pictures(files) => Values::Pictures(files),
        }
    }
}

fn packed_frames<'a>(feature: &Feature, frames: &'a Frames) -> Result<Packed<'a>, DataSetError> {
    let wrong = |what: String| DataSetError::Shape { feature: feature.name.clone(), what };
    match (&feature.kind, frames) {
        (FeatureKind::Numbers(names), Frames::Numbers(values)) => Ok(Packed::Numbers(values, names.len())),
        (FeatureKind::Pictures(encoding, [width, height]), Frames::Pictures(pictures)) => {
            let pack = |pixels: &Vec<u8>| pack_picture(*encoding, *width, *height, pixels).map_err(wrong);
            Ok(Packed::Pictures(pictures.iter().map(pack).collect::<Result<_, _>>()?))
        }
        _ => Err(wrong("an episode has something else there".into())),
    }
}
