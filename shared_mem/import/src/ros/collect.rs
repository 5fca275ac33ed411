//! The messages of a bag as tables: one a topic and publisher, with the numbers that may be of use.

use super::definition::{self, Arity, Field, Kind, Undefined};
use super::flat::{Flat, Unread};
use super::joined;
use super::known;
use super::wire::{Encoding, Reader};
use crate::log::{Column, LeftOut, Table};
use crate::naming;
use shared_mem::budget::{Budget, BudgetError};
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

/// Publishers, or transforms, of one topic that are read separately.
const MOST_LAYOUTS: usize = 64;

/// Why a topic is left out.
const PICTURES: &str = "pictures and other arrays of bytes are not imported";
const UNDEFINED: &str = "the bag holds no definition of its type that can be read";
const NUMBERLESS: &str = "it holds no number that a clip has a place for";
const CROWDED: &str = "its messages have too many forms";
const BROKEN: &str = "these of its messages are not what their type says";
const UNKNOWN: &str = "its messages are in a form that is not known; `ros2 bag convert` writes them in another";
const LONG: &str = "its messages hold more numbers than a row of any use";

/// What a topic, a column or a text takes beside its own bytes.
const OVERHEAD: usize = 128;

/// Types of a text, in ROS 2 and ROS 1.
const TEXT: [&str; 2] = ["std_msgs/msg/String", "std_msgs/String"];
/// What the topic of the robot's URDF is called, whatever namespace it lies in.
const DESCRIPTION: &str = "robot_description";

/// Takes messages and gives tables.
pub(crate) struct Collector<'a> {
    encoding: Encoding,
    budget: &'a Budget,
    types: HashMap<String, Option<Rc<Vec<Field>>>>,
    topics: BTreeMap<String, Topic>,
    description: Option<String>,
}

/// What came on one topic.
#[derive(Default)]
struct Topic {
    layouts: Vec<Layout>,
    left_out: BTreeMap<&'static str, u64>,
}

/// Messages of one shape, under one set of names.
struct Layout {
    shape: Vec<usize>,
    texts: Vec<String>,
    names: Vec<String>,
    /// Which of the numbers are kept.
    kept: Vec<usize>,
    columns: Vec<Vec<f64>>,
    stamps_ns: Vec<u64>,
    log_times_ns: Vec<u64>,
}

/// A message as it comes.
pub(crate) struct Incoming<'a> {
    pub(crate) topic: &'a str,
    pub(crate) type_name: &'a str,
    /// Empty where the bag has none.
    pub(crate) definition: &'a [u8],
    pub(crate) log_time_ns: u64,
    pub(crate) data: &'a [u8],
}

impl<'a> Collector<'a> {
    /// `budget`: that of the bag.
    pub(crate) fn new(encoding: Encoding, budget: &'a Budget) -> Self {
        Self { encoding, budget, types: HashMap::new(), topics: BTreeMap::new(), description: None }
    }

    /// What is left for the bag.
    pub(crate) fn budget(&self) -> &'a Budget {
        self.budget
    }

    /// Takes a message over; one that is not what its type says is left out.
    ///
    /// # Errors
    /// [`BudgetError`] when the budget is spent.
    pub(crate) fn take(&mut self, message: &Incoming<'_>) -> Result<(), BudgetError> {
        let (budget, fields) = (self.budget, self.fields(message)?);
        let topic = match self.topics.get_mut(message.topic) {
            Some(topic) => topic,
            None => {
                budget.take(message.topic.len() + OVERHEAD)?;
                self.topics.entry(message.topic.to_owned()).or_default()
            }
        };
        let Some(fields) = fields else {
            topic.leave_out(UNDEFINED);
            return Ok(());
        };
        let Ok(mut reader) = Reader::new(message.data, self.encoding) else {
            topic.leave_out(UNKNOWN);
            return Ok(());
        };
        if TEXT.contains(&message.type_name)
            && message.topic.ends_with(DESCRIPTION)
            && let Ok(text) = reader.clone().text()
        {
            self.description = Some(text.to_owned());
        }
        match topic.message(&fields, (&mut reader, budget), message.log_time_ns) {
            Ok(()) => Ok(()),
            Err(Unread::Broken) => {
                topic.leave_out(BROKEN);
                Ok(())
            }
            Err(Unread::Budget(over)) => Err(over),
        }
    }

    /// The fields of a message's type, where they are known.
    fn fields(&mut self, message: &Incoming<'_>) -> Result<Option<Rc<Vec<Field>>>, BudgetError> {
        if let Some(known) = self.types.get(message.type_name) {
            return Ok(known.clone());
        }
        self.budget.take(message.type_name.len() + OVERHEAD)?;
        let own = std::str::from_utf8(message.definition).unwrap_or("");
        let mut fields = None;
        for text in [own, &known::definition(message.type_name)] {
            if fields.is_some() || text.trim().is_empty() {
                continue;
            }
            fields = match definition::parse(message.type_name, text, self.budget) {
                Ok(fields) => Some(Rc::new(fields)),
                Err(Undefined::Text) => None,
                Err(Undefined::Budget(over)) => return Err(over),
            };
        }
        self.types.insert(message.type_name.to_owned(), fields.clone());
        Ok(fields)
    }

    /// The robot's URDF, where it was published.
    pub(crate) fn description(&mut self) -> Option<String> {
        self.description.take()
    }

    /// The tables, and what is in none of them.
    pub(crate) fn finish(self) -> (Vec<Table>, Vec<LeftOut>) {
        let (mut tables, mut left_out) = (Vec::new(), Vec::new());
        for (name, topic) in self.topics {
            left_out.extend(topic.left_out.iter().map(|(why, count)| LeftOut {
                what: name.clone(),
                why,
                count: *count,
            }));
            tables.extend(topic.tables(&name));
        }
        (joined::joined(tables), left_out)
    }
}

impl Topic {
    fn leave_out(&mut self, why: &'static str) {
        *self.left_out.entry(why).or_default() += 1;
    }

    /// Takes a message over: one row, or, of a list of messages, as many of them (transforms).
    fn message(
        &mut self,
        fields: &[Field],
        (reader, budget): (&mut Reader<'_>, &Budget),
        log_time_ns: u64,
    ) -> Result<(), Unread> {
        let [Field { kind: Kind::Message(inner), arity: Arity::Sequence, .. }] = fields else {
            return self.row(fields, (reader, budget), (log_time_ns, true));
        };
        let rows = reader.length()?;
        for row in 1..=rows {
            self.row(inner, (reader, budget), (log_time_ns, row == rows))?;
        }
        if reader.is_at_end() { Ok(()) } else { Err(Unread::Broken) }
    }

    /// Takes a row over; with the last one the message has to end.
    fn row(
        &mut self,
        fields: &[Field],
        (reader, budget): (&mut Reader<'_>, &Budget),
        (log_time_ns, is_last): (u64, bool),
    ) -> Result<(), Unread> {
        let again = reader.clone();
        let mut flat = Flat::read(fields, reader, false, budget)?;
        if is_last && !reader.is_at_end() {
            return Err(Unread::Broken);
        }
        if flat.has_bytes || flat.is_long {
            self.leave_out(if flat.has_bytes { PICTURES } else { LONG });
            return Ok(());
        }
        budget.step(self.layouts.len())?;
        let known = self.layouts.iter().position(|l| l.shape == flat.shape && l.texts == flat.texts);
        let at = match known {
            Some(at) => at,
            None => {
                let named = Flat::read(fields, &mut again.clone(), true, budget)?;
                budget.step(named.numbers.len() * self.layouts.len().max(1))?;
                // Names in another order are the same joints.
                let other = self.layouts.iter().enumerate().find_map(|(at, l)| Some((at, l.in_order(&named)?)));
                match other {
                    Some((at, numbers)) => {
                        flat.numbers = numbers;
                        at
                    }
                    None if self.layouts.len() >= MOST_LAYOUTS => {
                        self.leave_out(CROWDED);
                        return Ok(());
                    }
                    None => {
                        self.layouts.push(Layout::new(&named, budget)?);
                        self.layouts.len() - 1
                    }
                }
            }
        };
        if self.layouts.get(at).is_none_or(|layout| layout.kept.is_empty()) {
            self.leave_out(NUMBERLESS);
        } else if let Some(layout) = self.layouts.get_mut(at) {
            budget.elements(layout.kept.len() + 2, size_of::<f64>())?;
            layout.push(&flat, log_time_ns);
        }
        Ok(())
    }

    fn tables(self, topic: &str) -> Vec<Table> {
        let mut layouts: Vec<Layout> = self.layouts.into_iter().filter(|layout| !layout.stamps_ns.is_empty()).collect();
        // The publisher of most numbers has the topic's name; transforms have the name of where they lead to.
        layouts.sort_by_key(|layout| std::cmp::Reverse(layout.stamps_ns.len() * layout.kept.len()));
        let is_frames = layouts.iter().all(|layout| layout.shape.is_empty() && layout.texts.len() == 1);
        let table = |(number, layout): (usize, Layout)| {
            let label = layout.texts.first().cloned().unwrap_or_else(|| (number + 1).to_string());
            let name = if is_frames || number > 0 { format!("{topic}:{label}") } else { topic.to_owned() };
            layout.into_table(name)
        };
        layouts.into_iter().enumerate().map(table).collect()
    }
}

impl Layout {
    fn new(flat: &Flat<'_>, budget: &Budget) -> Result<Self, BudgetError> {
        let names = flat.names();
        let bytes = |texts: usize, sum: usize| sum + texts * OVERHEAD;
        budget.take(bytes(names.len(), names.iter().map(String::len).sum()))?;
        budget.take(bytes(flat.texts.len(), flat.texts.iter().map(|text| text.len()).sum()))?;
        let kept: Vec<usize> =
            (0..names.len()).filter(|i| names.get(*i).is_some_and(|n| naming::may_serve(n))).collect();
        Ok(Self {
            shape: flat.shape.clone(),
            texts: flat.texts.iter().map(|&text| text.to_owned()).collect(),
            columns: vec![Vec::new(); kept.len()],
            names,
            kept,
            stamps_ns: Vec::new(),
            log_times_ns: Vec::new(),
        })
    }

    /// The numbers of a message in the order of this one's names, where it has the same names in another order.
    fn in_order(&self, named: &Flat<'_>) -> Option<Vec<f64>> {
        let is_alike = self.shape == named.shape
            && self.texts.len() == named.texts.len()
            && named.texts.iter().all(|text| self.texts.iter().any(|own| own == text));
        if !is_alike {
            return None;
        }
        let names = named.names();
        let places: HashMap<&str, usize> = names.iter().enumerate().map(|(at, name)| (name.as_str(), at)).collect();
        let one = |name: &String| named.numbers.get(*places.get(name.as_str())?).copied();
        if places.len() == self.names.len() { self.names.iter().map(one).collect() } else { None }
    }

    fn push(&mut self, flat: &Flat<'_>, log_time_ns: u64) {
        for (column, at) in self.columns.iter_mut().zip(&self.kept) {
            column.push(flat.numbers.get(*at).copied().unwrap_or(f64::NAN));
        }
        self.stamps_ns.push(flat.stamp_ns.unwrap_or(0));
        self.log_times_ns.push(log_time_ns);
    }

    /// Stamps are the headers', or, where nobody filled these in, the times of recording.
    fn into_table(self, name: String) -> Table {
        let unstamped = self.stamps_ns.iter().all(|stamp| *stamp == 0);
        let names = self.kept.iter().filter_map(|at| self.names.get(*at)).cloned();
        Table {
            name,
            stamps_ns: Some(if unstamped { self.log_times_ns } else { self.stamps_ns }),
            columns: names.zip(self.columns).map(|(name, values)| Column { name, values }).collect(),
        }
    }
}
