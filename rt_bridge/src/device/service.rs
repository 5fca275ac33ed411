//! The thread of one device: rounds while it is there, tries while it is not.

use super::attendance::Attendance;
use super::{Device, DeviceFault, RETRY};
use crate::pump::Notice;
use crate::starting::{self, ThreadError};
use shared_mem::msg::event::EventLevel;
use shared_mem::transport::{Ignored, Node, TransportError};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How often an absent device's thread looks whether to end.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// A device's topics.
pub trait Lines<D: Device> {
    /// The newest order that came since the last question.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory fails.
    fn order(&mut self) -> Result<Option<D::Order>, TransportError>;

    /// Publishes what the device reported.
    ///
    /// # Errors
    /// [`TransportError`] when shared memory fails.
    fn publish(&mut self, sample: &D::Sample) -> Result<(), TransportError>;
}

/// A device at work. Dropping it ends its thread.
#[derive(Debug)]
pub struct Service {
    stop: Arc<AtomicBool>,
    handle: Option<JoinHandle<Option<String>>>,
}

/// A device cannot be taken into service.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    #[error(transparent)]
    Device(#[from] DeviceFault),
    #[error(transparent)]
    Transport(#[from] TransportError),
    #[error(transparent)]
    Thread(#[from] ThreadError),
}

impl Service {
    /// Opens `device` (its name for people) by `open` and keeps it at work in a thread called `name`, on the topics that
    /// `lines` opens there. A device that is not there from the start is refused: its name may be misspelt.
    ///
    /// # Errors
    /// [`ServiceError`] when the device cannot be opened, shared memory fails or there is no thread for it.
    pub fn start<D: Device, L: Lines<D>>(
        name: &'static str,
        device: String,
        mut open: impl FnMut() -> Result<D, DeviceFault> + Send + 'static,
        lines: impl FnOnce(&Node) -> Result<L, TransportError> + Send + 'static,
        notices: Sender<Notice>,
    ) -> Result<Self, ServiceError> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = stop.clone();
        let body = move |opened: Sender<Result<(), ServiceError>>| {
            // Device and ports belong to the thread that makes them.
            let start = || -> Result<_, ServiceError> {
                let first = open()?;
                let node = Node::open(name)?;
                let lines = lines(&node)?;
                Ok((first, node, lines))
            };
            let (first, node, mut lines) = match start() {
                Ok(all) => all,
                Err(e) => {
                    let _gone = opened.send(Err(e));
                    return None;
                }
            };
            let _gone = opened.send(Ok(()));
            let mut attendance = Attendance::new(device);
            let ignored = || node.newly_ignored();
            let ended = attend(first, &mut open, &mut lines, &mut attendance, ignored, &notices, &stopping);
            ended.err().map(|e| format!("{name} stopped: {e}")).or_else(|| attendance.missing())
        };
        let handle = starting::start(name, body)?;
        Ok(Self { stop, handle: Some(handle) })
    }

    /// Ends it; what was still wrong then.
    pub fn finish(mut self) -> Option<String> {
        self.end()
    }

    fn end(&mut self) -> Option<String> {
        self.stop.store(true, Ordering::Relaxed);
        self.handle.take()?.join().unwrap_or_else(|_| Some("a device's thread failed; please report this".into()))
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _known = self.end();
    }
}

/// Rounds until `stop`.
fn attend<D: Device>(
    first: D,
    open: &mut impl FnMut() -> Result<D, DeviceFault>,
    lines: &mut impl Lines<D>,
    attendance: &mut Attendance,
    ignored: impl Fn() -> Vec<Ignored>,
    notices: &Sender<Notice>,
    stop: &AtomicBool,
) -> Result<(), TransportError> {
    let say = |notice: Option<Notice>| {
        if let Some(notice) = notice {
            // The pump may have ended before; then nobody listens any more.
            let _gone = notices.send(notice);
        }
    };
    let mut device = Some(first);
    let mut tried = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        let order = lines.order()?;
        for ignored in ignored() {
            say(Some(Notice { level: EventLevel::Warning, text: ignored.to_string() }));
        }
        let Some(present) = &mut device else {
            if tried.elapsed() < RETRY {
                thread::sleep(LOOK_EVERY);
                continue;
            }
            tried = Instant::now();
            match open() {
                Ok(opened) => device = Some(opened),
                Err(fault) => say(attendance.lost(fault)),
            }
            continue;
        };
        match present.round(order.as_ref()) {
            Ok(Some(sample)) => {
                lines.publish(&sample)?;
                say(attendance.present());
                say(attendance.complains(present.complaint()));
            }
            Ok(None) => {}
            Err(fault) => {
                say(attendance.lost(fault));
                (device, tried) = (None, Instant::now());
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::collections::VecDeque;
    use std::rc::Rc;
    use std::sync::mpsc;

    /// Reports its number three times, then is gone.
    struct Short(u32, u32);

    impl Device for Short {
        type Sample = u32;
        type Order = ();

        fn round(&mut self, _order: Option<&()>) -> Result<Option<u32>, DeviceFault> {
            self.1 += 1;
            match self.1 {
                1 => Ok(None),
                2..=4 => Ok(Some(self.0)),
                _ => Err(DeviceFault::Gone { device: "short".into(), why: "unplugged".into() }),
            }
        }

        fn complaint(&self) -> Option<String> {
            (self.0 == 2).then(|| "is tired; let it rest".into())
        }
    }

    /// Ends the thread after the last expected sample.
    struct Seen(Vec<u32>, Rc<Cell<bool>>, Arc<AtomicBool>);

    impl Lines<Short> for Seen {
        fn order(&mut self) -> Result<Option<()>, TransportError> {
            Ok(None)
        }

        fn publish(&mut self, sample: &u32) -> Result<(), TransportError> {
            self.0.push(*sample);
            if self.0.len() == 6 {
                self.1.set(true);
                self.2.store(true, Ordering::Relaxed);
            }
            Ok(())
        }
    }

    #[test]
    fn a_device_that_goes_is_opened_anew_until_it_is_back() {
        let (notices, said) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let mut openings: VecDeque<Result<Short, DeviceFault>> = VecDeque::new();
        openings.push_back(Err(DeviceFault::Gone { device: "short".into(), why: "unplugged".into() }));
        openings.push_back(Ok(Short(2, 0)));
        let mut open = || openings.pop_front().expect("an opening");
        let done = Rc::new(Cell::new(false));
        let mut lines = Seen(Vec::new(), done.clone(), stop.clone());
        let mut attendance = Attendance::new("short".into());
        attend(Short(1, 0), &mut open, &mut lines, &mut attendance, Vec::new, &notices, &stop)
            .expect("no shared memory to fail");
        assert!(done.get());
        assert_eq!(lines.0, [1, 1, 1, 2, 2, 2]);
        let said: Vec<_> = said.try_iter().map(|notice| notice.text).collect();
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].starts_with("short is gone (unplugged)") && said[1] == "short is back");
        assert_eq!(said[2], "short is tired; let it rest");
    }
}
