//! Parquet files of numbers, texts and pictures, a group of rows for each call.

use super::DataSetError;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DataType, FloatType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use shared_mem::output::{Output, OutputFolder};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A column of a file.
#[derive(Debug, Clone)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Float,
    Long,
    /// As many numbers in each row.
    FloatList,
    Text,
    /// One text in each row, in a list.
    TextList,
    /// A PNG file's bytes.
    Picture,
}

/// Rows of a column.
#[derive(Debug, Clone, Copy)]
pub(super) enum Values<'a> {
    Floats(&'a [f32]),
    Longs(&'a [i64]),
    FloatLists(&'a [f32], usize),
    /// Of a [`Kind::Text`] or a [`Kind::TextList`].
    Texts(&'a [&'a str]),
    Pictures(&'a [Vec<u8>]),
}

/// A file that is being written.
#[derive(Debug)]
pub(super) struct TableFile {
    name: PathBuf,
    columns: Vec<Column>,
    writer: SerializedFileWriter<Output>,
}

impl TableFile {
    /// Begins a file of the folder; `record` goes into its footer.
    pub(super) fn begin(
        folder: &OutputFolder,
        name: &str,
        columns: &[Column],
        record: Option<(&str, String)>,
    ) -> Result<Self, DataSetError> {
        let name = PathBuf::from(name);
        let output = folder.file(&name)?;
        let record = record.map(|(key, value)| vec![KeyValue::new(key.to_owned(), value)]);
        // Pictures are packed already, and no two numbers are alike.
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_key_value_metadata(record)
            .build();
        let schema = parse_message_type(&schema(columns)).map_err(|error| fault(&name, &error))?;
        let writer = SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties));
        let writer = writer.map_err(|error| fault(&name, &error))?;
        Ok(Self { name, columns: columns.to_vec(), writer })
    }

    /// What has been written [bytes].
    pub(super) fn bytes(&self) -> u64 {
        self.writer.bytes_written() as u64
    }

    /// Writes a group of rows: values of each column.
    pub(super) fn rows(&mut self, values: &[Values<'_>]) -> Result<(), DataSetError> {
        let Self { name, columns, writer } = self;
        let mut write = || {
            let mut group = writer.next_row_group()?;
            for (column, values) in columns.iter().zip(values) {
                put(&mut group, column.kind, *values)?;
            }
            group.close().map(|_| ())
        };
        write().map_err(|error| fault(name, &error))
    }

    /// Completes the file.
    pub(super) fn finish(self) -> Result<(), DataSetError> {
        let output = self.writer.into_inner().map_err(|error| fault(&self.name, &error))?;
        Ok(output.finish()?)
    }
}

fn fault(name: &Path, error: &ParquetError) -> DataSetError {
    DataSetError::Table { file: name.to_owned(), what: error.to_string().replace('\n', " ") }
}

/// Every column may lack values, as pyarrow has it.
fn schema(columns: &[Column]) -> String {
    let mut text = "message schema {\n".to_owned();
    for Column { name, kind } in columns {
        let _ = match kind {
            Kind::Float => writeln!(text, "optional float {name};"),
            Kind::Long => writeln!(text, "optional int64 {name};"),
            Kind::Text => writeln!(text, "optional binary {name} (UTF8);"),
            Kind::FloatList => {
                writeln!(text, "optional group {name} (LIST) {{ repeated group list {{ optional float element; }} }}")
            }
            Kind::TextList => writeln!(
                text,
                "optional group {name} (LIST) {{ repeated group list {{ optional binary element (UTF8); }} }}"
            ),
            Kind::Picture => {
                writeln!(text, "optional group {name} {{ optional binary bytes; optional binary path (UTF8); }}")
            }
        };
    }
    text.push('}');
    text
}

fn put(group: &mut SerializedRowGroupWriter<'_, Output>, kind: Kind, values: Values<'_>) -> Result<(), ParquetError> {
    match values {
        Values::Floats(values) => leaf::<FloatType>(group, values, (1, values.len()), None),
        Values::Longs(values) => leaf::<Int64Type>(group, values, (1, values.len()), None),
        Values::FloatLists(values, width) => leaf::<FloatType>(group, values, (3, values.len()), Some(width)),
        Values::Texts(texts) => {
            let texts: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(*text)).collect();
            let (defined, width) = if kind == Kind::TextList { (3, Some(1)) } else { (1, None) };
            leaf::<ByteArrayType>(group, &texts, (defined, texts.len()), width)
        }
        Values::Pictures(files) => {
            let bytes: Vec<ByteArray> = files.iter().map(|file| ByteArray::from(file.clone())).collect();
            leaf::<ByteArrayType>(group, &bytes, (2, files.len()), None)?;
            // No file has that picture: the path is not there, the structure is.
            leaf::<ByteArrayType>(group, &[], (1, files.len()), None)
        }
    }
}

/// Writes a leaf of the schema: how deep its values are defined, and how many there are; `width` of them in each row of a list.
fn leaf<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Output>,
    values: &[T::T],
    (defined, count): (i16, usize),
    width: Option<usize>,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("it has fewer columns than values".into());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    let definitions = vec![defined; count];
    let repetitions: Option<Vec<i16>> =
        width.map(|width| (0..count).map(|i| i16::from(i % width.max(1) != 0)).collect());
    column.typed::<T>().write_batch(values, Some(&definitions), repetitions.as_deref())?;
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::RowAccessor as _;

    #[test]
    fn every_kind_of_column_is_read_back() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = OutputFolder::create(&place.path().join("data")).expect("a folder");
        let kinds = [Kind::Float, Kind::Long, Kind::FloatList, Kind::Text, Kind::TextList, Kind::Picture]
            .into_iter()
            .enumerate();
        let columns: Vec<Column> = kinds.map(|(i, kind)| Column { name: format!("of.{i}"), kind }).collect();
        let mut file = TableFile::begin(&folder, "a.parquet", &columns, None).expect("a file");
        for group in 0..2 {
            let texts = ["one", "two"];
            let pictures = [vec![1, 2, 3], vec![group]];
            let numbers: Vec<f32> = (0..6).map(|i| f32::from(group) + i as f32 / 7.0).collect();
            file.rows(&[
                Values::Floats(&numbers[..2]),
                Values::Longs(&[i64::from(group), i64::MIN]),
                Values::FloatLists(&numbers, 3),
                Values::Texts(&texts),
                Values::Texts(&texts),
                Values::Pictures(&pictures),
            ])
            .expect("rows");
        }
        file.finish().expect("room");
        folder.finish("").expect("room");
        let bytes = shared_mem::input::open(&place.path().join("data/a.parquet")).expect("the file");
        let reader = SerializedFileReader::new(bytes).expect("a parquet file");
        let rows: Vec<_> = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
        assert_eq!(rows.len(), 4);
        let row = &rows[3];
        assert_eq!(row.get_float(0).expect("a number"), 1.0 + 1.0 / 7.0);
        assert_eq!(row.get_long(1).expect("a number"), i64::MIN);
        let list = row.get_list(2).expect("a list");
        assert!(format!("{list:?}").contains(&format!("Float({})", 1.0_f32 + 5.0 / 7.0)), "{list:?}");
        assert_eq!(row.get_string(3).expect("a text"), "two");
        assert!(format!("{:?}", row.get_list(4).expect("a list")).contains("\"two\""));
        let picture = row.get_group(5).expect("a structure");
        assert_eq!(picture.get_bytes(0).expect("bytes").data(), [1]);
        assert!(picture.get_string(1).is_err(), "no path");
    }
}
