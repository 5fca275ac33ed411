//! Columns of numbers, and lists of numbers, of a parquet file. Anything else in it is passed over.

use crate::error::ImportError;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use std::path::Path;

/// Rows that are read at once.
const BATCH: usize = 8192;

/// A column: one number a row, or as many in each.
pub(super) struct Numbers {
    pub(super) name: String,
    /// Numbers in a row.
    pub(super) width: usize,
    /// Row by row.
    pub(super) values: Vec<f64>,
}

pub(super) fn read(path: &Path) -> Result<(usize, Vec<Numbers>), ImportError> {
    let file = shared_mem::input::open(path)?;
    let broken = |error: ParquetError| {
        let error = error.to_string().replace('\n', " ");
        ImportError::log(path, format!("is no whole parquet file ({error}); copy it from its source again"))
    };
    let reader = SerializedFileReader::new(file).map_err(broken)?;
    let metadata = reader.metadata();
    let rows = usize::try_from(metadata.file_metadata().num_rows()).unwrap_or(0);
    let schema = metadata.file_metadata().schema_descr_ptr();
    let mut found = Vec::new();
    for at in 0..schema.num_columns() {
        let column = schema.column(at);
        let parts = column.path().parts();
        let Some(name) = parts.first() else { continue };
        // A structure of several columns is a picture or the like.
        if schema.columns().iter().filter(|other| other.path().parts().first() == Some(name)).count() > 1 {
            continue;
        }
        let (defined, repeated) = (column.max_def_level(), column.max_rep_level());
        let mut all = Leaf { defined, repeated, ..Leaf::default() };
        let mut is_number = true;
        for group in 0..reader.num_row_groups() {
            super::go_on(path)?;
            let group = reader.get_row_group(group).map_err(broken)?;
            is_number = all.add(group.get_column_reader(at).map_err(broken)?).map_err(broken)?;
            if !is_number {
                break;
            }
        }
        if is_number {
            let wrong = |what: String| ImportError::log(path, format!("`{name}`: {what}"));
            found.push(all.finish(name, rows).map_err(wrong)?);
        }
    }
    Ok((rows, found))
}

/// A column as it is read.
#[derive(Default)]
struct Leaf {
    defined: i16,
    repeated: i16,
    values: Vec<f64>,
    /// Numbers in each row.
    widths: Vec<usize>,
}

impl Leaf {
    /// Takes a row group's part; false where it holds no numbers.
    fn add(&mut self, reader: ColumnReader) -> Result<bool, ParquetError> {
        match reader {
            ColumnReader::BoolColumnReader(r) => self.batches(r, |v| f64::from(u8::from(*v)))?,
            ColumnReader::Int32ColumnReader(r) => self.batches(r, |v| f64::from(*v))?,
            ColumnReader::Int64ColumnReader(r) => self.batches(r, |v| *v as f64)?,
            ColumnReader::FloatColumnReader(r) => self.batches(r, |v| f64::from(*v))?,
            ColumnReader::DoubleColumnReader(r) => self.batches(r, |v| *v)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn batches<T: DataType>(
        &mut self,
        mut reader: ColumnReaderImpl<T>,
        number: fn(&T::T) -> f64,
    ) -> Result<(), ParquetError> {
        let (mut values, mut defined, mut repeated) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            values.clear();
            defined.clear();
            repeated.clear();
            let (records, _, levels) =
                reader.read_records(BATCH, Some(&mut defined), Some(&mut repeated), &mut values)?;
            if records == 0 && levels == 0 {
                return Ok(());
            }
            let mut present = values.iter();
            for level in 0..levels {
                let there = self.defined == 0 || defined.get(level) == Some(&self.defined);
                let begins = self.repeated == 0 || repeated.get(level) == Some(&0);
                if begins {
                    self.widths.push(0);
                }
                // A missing number of a plain column is one that is not finite; a missing list has no numbers.
                let value = if there { present.next().map(number) } else { (self.repeated == 0).then_some(f64::NAN) };
                if let (Some(value), Some(width)) = (value, self.widths.last_mut()) {
                    self.values.push(value);
                    *width += 1;
                }
            }
        }
    }

    fn finish(self, name: &str, rows: usize) -> Result<Numbers, String> {
        let width = self.widths.first().copied().unwrap_or(0);
        if self.widths.len() != rows {
            return Err(format!(
                "{} of {rows} rows are there: the file is damaged; copy it from its source again",
                self.widths.len()
            ));
        }
        if let Some(row) = self.widths.iter().position(|other| *other != width) {
            return Err(format!(
                "row {row} holds {} numbers, the first {width}: the file is damaged",
                self.widths[row]
            ));
        }
        Ok(Numbers { name: name.to_owned(), width, values: self.values })
    }
}
