//! A client that lays out its bytes by hand, from the protocol's offsets.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::time::Duration;

/// Long enough for a busy machine; nothing is asserted about it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Offsets into a state and a set point.
pub(crate) mod at {
    pub(crate) const M_LOAD: usize = 444;
    pub(crate) const Q_D: usize = 624;
    pub(crate) const DQ: usize = 652;
    pub(crate) const GENERATOR: usize = 1288;
    pub(crate) const CONTROLLER: usize = 1289;
    pub(crate) const ERRORS: usize = 1290;
    pub(crate) const REASON: usize = 1331;
    pub(crate) const ROBOT_MODE: usize = 1372;
    pub(crate) const SUCCESS_RATE: usize = 1373;
    pub(crate) const Q_C: usize = 8;
    pub(crate) const MOTION_FINISHED: usize = 313;
    pub(crate) const TORQUE_FINISHED: usize = 370;
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Reply {
    pub(crate) number: u32,
    pub(crate) id: u32,
    pub(crate) payload: Vec<u8>,
}

/// A state, as bytes.
pub(crate) type State = [u8; 1377];

/// A connection to the arm.
pub(crate) struct Client {
    pub(crate) tcp: TcpStream,
    udp: UdpSocket,
    /// Where the last state came from.
    pub(crate) from: Option<SocketAddr>,
    next_id: u32,
}

impl Client {
    /// Connects without a word.
    pub(crate) fn silent(address: SocketAddr) -> Self {
        let tcp = TcpStream::connect(address).expect("somebody listens");
        tcp.set_read_timeout(Some(PATIENCE)).expect("a timeout above zero");
        let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        udp.set_read_timeout(Some(PATIENCE)).expect("a timeout above zero");
        Self { tcp, udp, from: None, next_id: 0 }
    }

    /// Connects and agrees on version 10.
    pub(crate) fn connected(address: SocketAddr) -> Self {
        let mut client = Self::silent(address);
        let reply = client.shake_hands(10);
        assert_eq!((reply.number, reply.id, &reply.payload[..]), (0, 0, &[0, 10, 0][..]));
        client
    }

    pub(crate) fn shake_hands(&mut self, version: u16) -> Reply {
        let message = self.handshake(version);
        self.tcp.write_all(&message).expect("the server reads");
        self.reply()
    }

    /// The bytes of a handshake.
    pub(crate) fn handshake(&mut self, version: u16) -> Vec<u8> {
        let port = self.udp.local_addr().expect("it is bound").port();
        self.message(0, &[version.to_le_bytes(), port.to_le_bytes()].concat())
    }

    fn message(&mut self, number: u32, payload: &[u8]) -> Vec<u8> {
        let (id, size) = (self.next_id, 12 + u32::try_from(payload.len()).expect("a short payload"));
        self.next_id += 1;
        [&number.to_le_bytes()[..], &id.to_le_bytes(), &size.to_le_bytes(), payload].concat()
    }

    /// Sends a request; its counter.
    pub(crate) fn send(&mut self, number: u32, payload: &[u8]) -> u32 {
        let message = self.message(number, payload);
        self.tcp.write_all(&message).expect("the server reads");
        self.next_id - 1
    }

    /// The next reply.
    pub(crate) fn reply(&mut self) -> Reply {
        let mut header = [0; 12];
        self.tcp.read_exact(&mut header).expect("a reply");
        let word = |i: usize| u32::from_le_bytes([header[i], header[i + 1], header[i + 2], header[i + 3]]);
        let mut payload = vec![0; word(8) as usize - 12];
        self.tcp.read_exact(&mut payload).expect("the rest of it");
        Reply { number: word(0), id: word(4), payload }
    }

    /// Sends a request and returns the status of the reply to it, which has to be the next one.
    pub(crate) fn ask(&mut self, number: u32, payload: &[u8]) -> u8 {
        let id = self.send(number, payload);
        let reply = self.reply();
        assert_eq!((reply.number, reply.id), (number, id));
        reply.payload[0]
    }

    /// The next state.
    pub(crate) fn state(&mut self) -> State {
        let mut state = [0; 1400];
        let (length, from) = self.udp.recv_from(&mut state).expect("a state");
        self.from = Some(from);
        state[..length].try_into().expect("1377 bytes")
    }

    /// `true` when a state comes within the time in which the robot sends a hundred.
    pub(crate) fn gets_states(&self) -> bool {
        self.udp.set_read_timeout(Some(Duration::from_millis(100))).expect("a timeout above zero");
        let came = self.udp.recv(&mut [0; 1400]).is_ok();
        self.udp.set_read_timeout(Some(PATIENCE)).expect("a timeout above zero");
        came
    }

    /// Reads states until one is in this mode.
    pub(crate) fn state_in_mode(&mut self, mode: u8) -> State {
        loop {
            let state = self.state();
            if state[at::ROBOT_MODE] == mode {
                return state;
            }
        }
    }

    /// Answers `state` with a set point that holds where the robot is told to be, changed by `change`.
    pub(crate) fn answer(&self, state: &State, change: impl FnOnce(&mut [u8; 371])) {
        let mut command = [0; 371];
        command[..8].copy_from_slice(&state[..8]);
        for (i, q_d) in numbers(state, at::Q_D, 7).iter().enumerate() {
            command[at::Q_C + 8 * i..at::Q_C + 8 * i + 8].copy_from_slice(&q_d.to_le_bytes());
        }
        change(&mut command);
        self.send_datagram(&command);
    }

    pub(crate) fn send_datagram(&self, datagram: &[u8]) {
        self.udp.send_to(datagram, self.from.expect("a state came first")).expect("the loopback carries it");
    }

    /// `true` when the server has closed the connection.
    pub(crate) fn is_cut_off(&mut self) -> bool {
        let mut rest = [0; 1];
        match self.tcp.read(&mut rest) {
            Ok(length) => length == 0,
            Err(error) => matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe),
        }
    }
}

/// Payload of a Move: joint positions (0) or none (4), joint impedance (0) or external (2).
pub(crate) fn motion(controller: u32, generator: u32) -> Vec<u8> {
    let wide: Vec<u8> = [10.0_f64, 3.12, 6.0, 10.0, 3.12, 6.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    [&controller.to_le_bytes()[..], &generator.to_le_bytes(), &wide, &[0; 57]].concat()
}

/// 32-bit numbers of a state.
pub(crate) fn numbers(state: &State, offset: usize, count: usize) -> Vec<f64> {
    let word = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    state[offset..offset + 4 * count].chunks_exact(4).map(word).collect()
}
