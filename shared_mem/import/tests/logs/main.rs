//! Logs of other programs become sessions, or are refused.

mod columns;
mod cut;
mod damaged;
mod data_set;
mod formats;
mod hostile;
mod lab;
mod lag;
mod names;
mod other_forms;
mod weight;
mod written;
