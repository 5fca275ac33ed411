//! What the control thread asks of Linux: a real-time priority, its own core, memory that stays, and sleep until a
//! moment. The only file of this crate with `unsafe`: thin wrappers around `libc` calls that have no safe form.

use std::io;
use std::mem::MaybeUninit;
use std::net::UdpSocket;
use std::os::fd::AsRawFd as _;

/// Priority of the control thread under `SCHED_FIFO`: above ordinary interrupts' threads (50), below the kernel's own watchdogs (99).
pub const CONTROL_PRIORITY: i32 = 80;
/// Priority of the thread that stands in for the robot: it has to answer within a cycle, but never delays the control thread.
pub const SIMULATION_PRIORITY: i32 = 60;
/// Priority of the pump: it publishes within the cycle, but never delays the two above.
pub const PUMP_PRIORITY: i32 = 40;
/// Stack that is touched in advance, so that no page is missing while the loop runs [bytes].
const STACK_PREFAULT: usize = 256 * 1024;

/// Puts the calling thread under `SCHED_FIFO`.
///
/// # Errors
/// The kernel's: usually "operation not permitted", when the limit `rtprio` is too low.
pub fn set_fifo(priority: i32) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: priority };
    // SAFETY: thread id 0 is the calling thread; the pointer is to a live, initialised struct.
    let rc = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    outcome(rc)
}

/// Binds the calling thread to one core.
///
/// # Errors
/// The kernel's: "invalid argument" when this process may not use the core.
pub fn pin_to(core: usize) -> io::Result<()> {
    if core >= libc::CPU_SETSIZE as usize {
        return Err(io::Error::from(io::ErrorKind::InvalidInput));
    }
    // SAFETY: an all-zero cpu_set_t is the empty set; CPU_SET stays inside it because `core` was checked above.
    let set = unsafe {
        let mut set = MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init();
        libc::CPU_SET(core, &mut set);
        set
    };
    // SAFETY: thread id 0 is the calling thread; size and pointer describe the same live set.
    let rc = unsafe { libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) };
    outcome(rc)
}

/// The highest-numbered core this process may use: interrupts and other programs crowd the first ones.
pub fn last_core() -> Option<usize> {
    // SAFETY: an all-zero cpu_set_t is the empty set.
    let mut set = unsafe { MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init() };
    // SAFETY: thread id 0 is the calling thread; size and pointer describe the same live set.
    let rc = unsafe { libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &raw mut set) };
    outcome(rc).ok()?;
    // SAFETY: every index is below CPU_SETSIZE, the number of bits in the set.
    (0..libc::CPU_SETSIZE as usize).rev().find(|core| unsafe { libc::CPU_ISSET(*core, &set) })
}

/// Keeps all memory of this process, present and future, in RAM.
///
/// # Errors
/// The kernel's: "cannot allocate memory" when the limit `memlock` is too low. A finite limit is refused here already:
/// under it, locking would succeed now and let a later mapping of shared memory fail.
pub fn lock_memory() -> io::Result<()> {
    if !may_lock_all_memory() {
        return Err(io::Error::from_raw_os_error(libc::ENOMEM));
    }
    // SAFETY: takes flags only.
    let rc = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    outcome(rc)
}

/// `true` when no limit stands in the way of locking all memory: the limit is infinite, or the superuser asks.
pub fn may_lock_all_memory() -> bool {
    // SAFETY: takes nothing and cannot fail.
    let superuser = unsafe { libc::geteuid() } == 0;
    superuser || matches!(limit(Limit::LockedMemory), Ok((None, _)))
}

/// Lets the calling thread's timers be as exact as the clock. Linux gathers those of ordinary threads within 50 us; those of
/// `SCHED_FIFO` threads are exact by themselves.
pub fn set_exact_timers() {
    const SLACK_NS: libc::c_ulong = 1;
    // SAFETY: takes numbers only; the one failure there is, an unknown option, leaves all as it was.
    let _unchanged = unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, SLACK_NS, 0, 0, 0) };
}

/// Touches the stack below the caller, so that its pages are there before the loop needs them.
#[inline(never)]
pub fn prefault_stack() {
    let mut stack = [0_u8; STACK_PREFAULT];
    for byte in stack.iter_mut().step_by(1024) {
        *byte = 1;
    }
    std::hint::black_box(&stack);
}

/// Sleeps until the monotonic clock shows `deadline_ns`. Returns at once when that has passed; sleeps on after a signal.
pub fn sleep_until(deadline_ns: u64) {
    let deadline = libc::timespec {
        tv_sec: libc::time_t::try_from(deadline_ns / 1_000_000_000).unwrap_or(libc::time_t::MAX),
        tv_nsec: libc::c_long::try_from(deadline_ns % 1_000_000_000).unwrap_or(0),
    };
    loop {
        // SAFETY: the deadline is live and initialised; an absolute sleep writes no remainder, so null is allowed.
        let rc = unsafe {
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const deadline, std::ptr::null_mut())
        };
        if rc != libc::EINTR {
            return;
        }
    }
}

/// A resource limit of this process: (soft, hard), `None` for "unlimited".
///
/// # Errors
/// The kernel's.
pub fn limit(resource: Limit) -> io::Result<(Option<u64>, Option<u64>)> {
    let which = match resource {
        Limit::RealtimePriority => libc::RLIMIT_RTPRIO,
        Limit::LockedMemory => libc::RLIMIT_MEMLOCK,
    };
    let mut found = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the pointer is to a live struct that the call fills in.
    let rc = unsafe { libc::getrlimit(which, &raw mut found) };
    outcome(rc)?;
    let finite = |value: libc::rlim_t| (value != libc::RLIM_INFINITY).then_some(value);
    Ok((finite(found.rlim_cur), finite(found.rlim_max)))
}

/// A resource that [`limit`] knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Highest `SCHED_FIFO` priority that may be asked for.
    RealtimePriority,
    /// Memory that may be locked [bytes].
    LockedMemory,
}

/// How long a network interface keeps packets back, to interrupt the processor once for several of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketHold {
    /// Those that come in [us].
    pub receive_us: u32,
    /// Those that were sent, before it says so [us].
    pub send_us: u32,
    /// It changes the time for those that come in by itself.
    pub is_adaptive: bool,
}

/// Linux's question for [`PacketHold`], and its answer: `struct ethtool_coalesce`.
#[repr(C)]
struct Coalesce {
    question: u32,
    receive_us: u32,
    receive_frames_and_interrupt: [u32; 3],
    send_us: u32,
    send_frames_interrupt_and_statistics: [u32; 4],
    adaptive_receive: u32,
    rest: [u32; 12],
}

/// Asks a network interface, as `ethtool -c` does.
///
/// # Errors
/// The kernel's: "operation not supported" where it keeps nothing back, "no such device".
pub fn packet_hold(interface: &str) -> io::Result<PacketHold> {
    const GET_COALESCE: u32 = 0xe;
    let socket = UdpSocket::bind(("0.0.0.0", 0))?;
    let mut answer = Coalesce {
        question: GET_COALESCE,
        receive_us: 0,
        receive_frames_and_interrupt: [0; 3],
        send_us: 0,
        send_frames_interrupt_and_statistics: [0; 4],
        adaptive_receive: 0,
        rest: [0; 12],
    };
    // SAFETY: an all-zero ifreq is one without a name.
    let mut request = unsafe { MaybeUninit::<libc::ifreq>::zeroed().assume_init() };
    let name = request.ifr_name.iter_mut().zip(interface.bytes());
    name.for_each(|(place, byte)| *place = byte as libc::c_char);
    // Shortened, it would be the name of another one.
    if interface.len() >= request.ifr_name.len() {
        return Err(io::Error::from(io::ErrorKind::InvalidInput));
    }
    request.ifr_ifru.ifru_data = (&raw mut answer).cast();
    // SAFETY: the request names an answer that lives longer than the call and is as long as the question asks for.
    let rc = unsafe { libc::ioctl(socket.as_raw_fd(), libc::SIOCETHTOOL, &raw mut request) };
    outcome(rc)?;
    let Coalesce { receive_us, send_us, adaptive_receive, .. } = answer;
    Ok(PacketHold { receive_us, send_us, is_adaptive: adaptive_receive != 0 })
}

/// Asks a process to end in its own orderly way (`SIGTERM`).
///
/// # Errors
/// The kernel's: "no such process" when it has ended already.
pub fn ask_to_end(pid: u32) -> io::Result<()> {
    let pid = libc::pid_t::try_from(pid).map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
    // SAFETY: takes numbers only.
    let rc = unsafe { libc::kill(pid, libc::SIGTERM) };
    outcome(rc)
}

fn outcome(rc: libc::c_int) -> io::Result<()> {
    if rc == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::time::now_ns;

    #[test]
    fn sleeping_until_a_moment_never_wakes_before_it() {
        let deadline = now_ns() + 3_000_000;
        sleep_until(deadline);
        assert!(now_ns() >= deadline);
        sleep_until(deadline - 1_000_000);
    }

    #[test]
    fn an_interface_that_is_not_there_or_keeps_nothing_back_is_an_error() {
        // 23 numbers of 32 bits, as the kernel writes them.
        assert_eq!(size_of::<Coalesce>(), 92);
        for interface in ["lo", "no-such-one", "longer-than-a-name-may-be"] {
            assert!(packet_hold(interface).is_err(), "{interface}");
        }
    }

    #[test]
    fn a_core_that_is_not_there_is_refused() {
        assert!(pin_to(libc::CPU_SETSIZE as usize).is_err());
        assert!(last_core().is_some());
    }
}
