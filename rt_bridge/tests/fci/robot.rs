//! A scripted robot: answers like an FCI version 10 controller that stands still, and does on demand what robots do when
//! things go wrong. Offsets are those of the version-10 datagrams (state 1377 bytes of f32, command 371 bytes of f64).

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::Duration;

pub(crate) const STATE_LENGTH: usize = 1377;
pub(crate) const COMMAND_LENGTH: usize = 371;
pub(crate) const IDLE: u8 = 1;
pub(crate) const MOVE: u8 = 2;
pub(crate) const REFLEX: u8 = 4;

/// Offsets into a state.
pub(crate) mod at {
    pub(crate) const TAU_J: usize = 512;
    pub(crate) const TAU_J_D: usize = 540;
    pub(crate) const Q: usize = 596;
    pub(crate) const Q_D: usize = 624;
    pub(crate) const DQ: usize = 652;
    pub(crate) const DQ_D: usize = 680;
    pub(crate) const TAU_EXT: usize = 840;
    pub(crate) const O_T_EE: usize = 8;
    pub(crate) const M_EE: usize = 392;
    pub(crate) const GENERATOR: usize = 1288;
    pub(crate) const CONTROLLER: usize = 1289;
    pub(crate) const ERRORS: usize = 1290;
    pub(crate) const REFLEX_REASON: usize = 1331;
    pub(crate) const ROBOT_MODE: usize = 1372;
    pub(crate) const SUCCESS_RATE: usize = 1373;
}

/// What the script and its robot share.
pub(crate) struct Script {
    /// Next state to be sent; the counter is filled in.
    pub(crate) state: [u8; STATE_LENGTH],
    /// Requests seen: number and payload.
    pub(crate) requests: Vec<(u32, Vec<u8>)>,
    /// Set points seen.
    pub(crate) commands: Vec<[u8; COMMAND_LENGTH]>,
    /// Counter of the robot [ms].
    pub(crate) counter: u64,
    /// No more states are sent.
    pub(crate) silent: bool,
    /// The connection is to be dropped.
    pub(crate) gone: bool,
    /// What is sent before each state and from the same port, by the state and its counter.
    pub(crate) before_each: fn(&[u8; STATE_LENGTH], u64) -> Vec<[u8; STATE_LENGTH]>,
    /// Where states go.
    pub(crate) client: Option<SocketAddr>,
    move_id: Option<u32>,
}

impl Script {
    pub(crate) fn write(&mut self, offset: usize, values: &[f32]) {
        for (i, value) in values.iter().enumerate() {
            self.state[offset + 4 * i..offset + 4 * i + 4].copy_from_slice(&value.to_le_bytes());
        }
    }

    /// Ends a running motion with these modes.
    fn modes(&mut self, robot: u8, generator: u8, controller: u8) {
        self.state[at::ROBOT_MODE] = robot;
        self.state[at::GENERATOR] = generator;
        self.state[at::CONTROLLER] = controller;
    }

    /// The robot stops itself for reason `error`.
    pub(crate) fn reflex(&mut self, error: usize) {
        self.state[at::ERRORS + error] = 1;
        self.state[at::REFLEX_REASON + error] = 1;
        self.modes(REFLEX, 0, 3);
    }
}

/// A robot that listens.
pub(crate) struct Robot {
    /// Where to connect to.
    pub(crate) host: String,
    script: Arc<Mutex<Script>>,
}

impl Robot {
    /// A robot that answers the handshake with `status` and `version`.
    pub(crate) fn answering(status: u8, version: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port on the loopback");
        let host = listener.local_addr().expect("it is bound").to_string();
        let mut script = Script {
            state: [0; STATE_LENGTH],
            requests: Vec::new(),
            commands: Vec::new(),
            counter: 1000,
            silent: false,
            gone: false,
            before_each: |_, _| Vec::new(),
            client: None,
            move_id: None,
        };
        script.modes(IDLE, 0, 3);
        let script = Arc::new(Mutex::new(script));
        let shared = Arc::clone(&script);
        thread::spawn(move || serve(&listener, &shared, status, version));
        Self { host, script }
    }

    /// A robot of our version.
    pub(crate) fn new() -> Self {
        Self::answering(0, 10)
    }

    pub(crate) fn script(&self) -> MutexGuard<'_, Script> {
        self.script.lock().expect("no test panics while it holds the script")
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        if let Ok(mut script) = self.script.lock() {
            script.gone = true;
        }
    }
}

fn serve(listener: &TcpListener, script: &Arc<Mutex<Script>>, status: u8, version: u16) {
    let Ok((mut tcp, peer)) = listener.accept() else { return };
    tcp.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout above zero");
    while !script.lock().expect("not poisoned").gone {
        let Some((number, id, payload)) = request(&mut tcp) else { continue };
        let mut reply = vec![0];
        match number {
            0 => {
                reply = [&[status][..], &version.to_le_bytes()].concat();
                let port = u16::from_le_bytes([payload[2], payload[3]]);
                script.lock().expect("not poisoned").client = Some(SocketAddr::new(peer.ip(), port));
                let script = Arc::clone(script);
                let writer = tcp.try_clone().expect("a second handle");
                thread::spawn(move || stream(&script, SocketAddr::new(peer.ip(), port), writer));
            }
            1 => {
                reply = vec![1];
                let mut script = script.lock().expect("not poisoned");
                script.move_id = Some(id);
                // Torque control is generator "none" (4 asked for, 5 shown) with the external controller.
                let (generator, controller) = if payload[4] == 4 { (5, 2) } else { (1, 0) };
                script.modes(MOVE, generator, controller);
            }
            10 => {
                let mut script = script.lock().expect("not poisoned");
                script.state[at::ERRORS..at::REFLEX_REASON].fill(0);
                script.modes(IDLE, 0, 3);
            }
            _ => {}
        }
        script.lock().expect("not poisoned").requests.push((number, payload));
        answer(&mut tcp, number, id, &reply);
    }
}

/// Sends states and takes set points until the script ends.
fn stream(script: &Arc<Mutex<Script>>, client: SocketAddr, mut tcp: TcpStream) {
    let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port on the loopback");
    udp.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout above zero");
    let mut command = [0; COMMAND_LENGTH + 1];
    loop {
        {
            let mut script = script.lock().expect("not poisoned");
            if script.gone {
                return;
            }
            script.counter += 1;
            let counter = script.counter.to_le_bytes();
            script.state[..8].copy_from_slice(&counter);
            if !script.silent {
                for datagram in (script.before_each)(&script.state, script.counter) {
                    udp.send_to(&datagram, client).expect("the loopback carries it");
                }
                udp.send_to(&script.state, client).expect("the loopback carries it");
            }
        }
        let Ok(length) = udp.recv(&mut command) else { continue };
        assert_eq!(length, COMMAND_LENGTH, "a set point has 371 bytes");
        let mut script = script.lock().expect("not poisoned");
        let mut kept = [0; COMMAND_LENGTH];
        kept.copy_from_slice(&command[..COMMAND_LENGTH]);
        script.commands.push(kept);
        let finished = kept[313] == 1 || kept[370] == 1;
        if finished && let Some(id) = script.move_id.take() {
            script.modes(IDLE, 0, 3);
            answer(&mut tcp, 1, id, &[0]);
        }
    }
}

fn request(tcp: &mut TcpStream) -> Option<(u32, u32, Vec<u8>)> {
    let mut header = [0; 12];
    tcp.read_exact(&mut header).ok()?;
    let word = |i: usize| u32::from_le_bytes([header[i], header[i + 1], header[i + 2], header[i + 3]]);
    let mut payload = vec![0; word(8) as usize - 12];
    tcp.read_exact(&mut payload).ok()?;
    Some((word(0), word(4), payload))
}

fn answer(tcp: &mut TcpStream, number: u32, id: u32, reply: &[u8]) {
    let size = 12 + u32::try_from(reply.len()).expect("a short reply");
    let message = [&number.to_le_bytes()[..], &id.to_le_bytes(), &size.to_le_bytes(), reply].concat();
    tcp.write_all(&message).expect("the client reads its replies");
}
