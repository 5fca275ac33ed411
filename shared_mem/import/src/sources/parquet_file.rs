//! Columns of numbers, and lists of numbers, of a parquet file. Anything else in it is passed over.
//!
//! A page of a few bytes may hold any number of values, each the same: what a page says that it holds is drawn from the budget
//! before it is decoded.

use crate::error::ImportError;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use shared_mem::budget::{Budget, BudgetError};
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

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

/// Rows and columns of a file that has `most` rows at most.
pub(super) fn read(path: &Path, most: usize, budget: &Budget) -> Result<(usize, Vec<Numbers>), ImportError> {
    let file = shared_mem::input::open(path)?;
    let spent = Spent::default();
    let broken = |error: ParquetError| match spent.get() {
        Some(spent) => ImportError::budget(path)(spent),
        None => {
            let error = error.to_string().replace('\n', " ");
            // A file without its end is named in plain words.
            let cut = ["Corrupt footer", "Invalid Parquet", "EOF"].iter().any(|word| error.contains(word));
            let error = if cut { String::new() } else { format!(" ({error})") };
            let what = format!(
                "is no whole parquet file{error}; copy it from its source again, or leave it out: one whose recorder did not \
                 close it has no index, and cannot be read"
            );
            ImportError::log(path, what)
        }
    };
    let reader = SerializedFileReader::new(file).map_err(broken)?;
    let metadata = reader.metadata();
    let rows = usize::try_from(metadata.file_metadata().num_rows()).unwrap_or(0);
    if rows > most {
        let what = format!(
            "has {rows} rows, and meta/info.json leaves {most} for it: the data set is damaged; take it from its source again, or mend that file"
        );
        return Err(ImportError::log(path, what));
    }
    let schema = metadata.file_metadata().schema_descr_ptr();
    let mut leaves: HashMap<&str, usize> = HashMap::new();
    for column in schema.columns() {
        *leaves.entry(column.path().parts().first().map_or("", String::as_str)).or_default() += 1;
    }
    let mut found = Vec::new();
    for (at, column) in schema.columns().iter().enumerate() {
        let Some(name) = column.path().parts().first() else { continue };
        // A structure of several columns is a picture or the like.
        if leaves.get(name.as_str()) != Some(&1) {
            continue;
        }
        let mut all = Leaf::new(column.max_def_level(), column.max_rep_level(), budget, &spent);
        let mut is_number = true;
        for group in 0..reader.num_row_groups() {
            super::go_on(path)?;
            let group = reader.get_row_group(group).map_err(broken)?;
            let pages = group.get_column_page_reader(at).map_err(broken)?;
            let pages = Box::new(Pages { inner: pages, budget: budget.clone(), spent: spent.clone() });
            is_number = all.add(get_column_reader(Arc::clone(column), pages)).map_err(broken)?;
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

/// What a page may hold for each of its values while it is decoded: the number and its two levels [bytes].
const OF_A_VALUE: usize = size_of::<f64>() + 2 * size_of::<i16>();

/// Why a file is not read further, where it is its budget: the library has no place for it.
#[derive(Debug, Clone, Default)]
struct Spent(Arc<Mutex<Option<BudgetError>>>);

impl Spent {
    fn get(&self) -> Option<BudgetError> {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps why a budget is spent.
    fn drawn(&self, drawn: Result<(), BudgetError>) -> Result<(), ParquetError> {
        drawn.map_err(|spent| {
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(spent);
            ParquetError::General(spent.to_string())
        })
    }
}

/// The pages of a column, each of which is paid for before it is decoded.
struct Pages {
    inner: Box<dyn PageReader>,
    budget: Budget,
    spent: Spent,
}

impl Pages {
    fn pay(&self, page: &Page) -> Result<(), ParquetError> {
        let (values, bytes) = (page.num_values() as usize, page.buffer().len());
        self.spent.drawn(self.budget.elements(values, OF_A_VALUE))?;
        self.spent.drawn(self.budget.take(bytes))?;
        // Once the next page comes this one is gone, and its numbers are counted where they are kept.
        self.budget.give_back(values * OF_A_VALUE + bytes);
        Ok(())
    }
}

impl Iterator for Pages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.inner.get_next_page()?;
        page.as_ref().map_or(Ok(()), |page| self.pay(page))?;
        Ok(page)
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.inner.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.inner.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool, ParquetError> {
        self.inner.at_record_boundary()
    }
}

/// A column as it is read.
struct Leaf<'a> {
    defined: i16,
    repeated: i16,
    values: Vec<f64>,
    /// Rows that have begun.
    rows: usize,
    /// Numbers in the row that has begun last, and in the first.
    width: usize,
    first: usize,
    /// The first row of another width than the first, and that width.
    odd: Option<(usize, usize)>,
    budget: &'a Budget,
    spent: &'a Spent,
}

impl<'a> Leaf<'a> {
    fn new(defined: i16, repeated: i16, budget: &'a Budget, spent: &'a Spent) -> Self {
        Self { defined, repeated, values: Vec::new(), rows: 0, width: 0, first: 0, odd: None, budget, spent }
    }

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
            self.spent.drawn(self.budget.elements(levels, size_of::<f64>()))?;
            let mut present = values.iter();
            for level in 0..levels {
                let there = self.defined == 0 || defined.get(level) == Some(&self.defined);
                if self.repeated == 0 || repeated.get(level) == Some(&0) {
                    self.begin_row();
                }
                // A missing number of a plain column is one that is not finite; a missing list has no numbers.
                let value = if there { present.next().map(number) } else { (self.repeated == 0).then_some(f64::NAN) };
                if let Some(value) = value {
                    self.values.push(value);
                    self.width += 1;
                }
            }
        }
    }

    fn begin_row(&mut self) {
        self.end_row();
        self.rows += 1;
        self.width = 0;
    }

    /// All numbers of the row are there that has begun last.
    fn end_row(&mut self) {
        match self.rows {
            0 => {}
            1 => self.first = self.width,
            row if self.width != self.first => drop(self.odd.get_or_insert((row - 1, self.width))),
            _ => {}
        }
    }

    fn finish(mut self, name: &str, rows: usize) -> Result<Numbers, String> {
        self.end_row();
        if self.rows != rows {
            return Err(format!(
                "{} of {rows} rows are there: the file is damaged; copy it from its source again",
                self.rows
            ));
        }
        if let Some((row, width)) = self.odd {
            return Err(format!(
                "row {row} holds {width} numbers, the first {}: the file is damaged; copy it from its source again",
                self.first
            ));
        }
        Ok(Numbers { name: name.to_owned(), width: self.first, values: self.values })
    }
}
