//! Who is there: which of a device's failures and returns are news. Pure.

use super::DeviceFault;
use crate::pump::Notice;
use shared_mem::msg::event::EventLevel;

/// What is known about one device's presence.
#[derive(Debug)]
pub(super) struct Attendance {
    device: String,
    lost: Option<DeviceFault>,
    complaint: Option<String>,
}

impl Attendance {
    /// A device that was just opened.
    pub(super) fn new(device: String) -> Self {
        Self { device, lost: None, complaint: None }
    }

    /// The device reported something.
    pub(super) fn present(&mut self) -> Option<Notice> {
        self.lost.take().map(|_| Notice { level: EventLevel::Info, text: format!("{} is back", self.device) })
    }

    /// The device failed. The same failure again is no news, nor is that a device that is gone cannot be opened.
    pub(super) fn lost(&mut self, fault: DeviceFault) -> Option<Notice> {
        let gone = matches!(self.lost, Some(DeviceFault::Gone { .. }));
        if self.lost.as_ref() == Some(&fault) || gone && matches!(fault, DeviceFault::NotOpened { .. }) {
            return None;
        }
        let text = fault.to_string();
        self.lost = Some(fault);
        Some(Notice { level: EventLevel::Error, text })
    }

    /// What the device complains about now.
    pub(super) fn complains(&mut self, about: Option<String>) -> Option<Notice> {
        if self.complaint == about {
            return None;
        }
        self.complaint = about;
        let notice = match &self.complaint {
            Some(text) => Notice { level: EventLevel::Warning, text: format!("{} {text}", self.device) },
            None => Notice { level: EventLevel::Info, text: format!("{} is content again", self.device) },
        };
        Some(notice)
    }

    /// The failure that still lasts.
    pub(super) fn missing(self) -> Option<String> {
        self.lost.map(|fault| fault.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silent() -> DeviceFault {
        DeviceFault::Silent { device: "the gripper".into(), check: "its power" }
    }

    #[test]
    fn a_failure_is_said_once_and_so_is_the_return() {
        let mut attendance = Attendance::new("the gripper".into());
        assert!(attendance.present().is_none());
        let said = attendance.lost(silent()).expect("news");
        assert_eq!(said.level, EventLevel::Error);
        assert!(said.text.contains("does not answer; check its power") && !said.text.contains('\n'));
        assert!(attendance.lost(silent()).is_none());
        let other = DeviceFault::Gone { device: "the gripper".into(), why: "unplugged".into() };
        assert!(attendance.lost(other).is_some(), "another failure is news");
        let closed = |why: &str| DeviceFault::NotOpened { device: "it".into(), why: why.into(), remedy: "wait".into() };
        assert!(attendance.lost(closed("no such file")).is_none(), "what is gone cannot be opened");
        assert_eq!(attendance.present().expect("news").text, "the gripper is back");
        assert!(attendance.present().is_none());
        assert_eq!(attendance.missing(), None);
    }

    #[test]
    fn a_complaint_is_said_when_it_comes_changes_and_ends() {
        let mut attendance = Attendance::new("the gripper".into());
        let mut says = |about: Option<&str>| attendance.complains(about.map(str::to_owned)).map(|notice| notice.text);
        assert_eq!(says(None), None);
        assert_eq!(says(Some("is hot; let it cool")).as_deref(), Some("the gripper is hot; let it cool"));
        assert_eq!(says(Some("is hot; let it cool")), None);
        assert_eq!(says(None).as_deref(), Some("the gripper is content again"));
    }
}
