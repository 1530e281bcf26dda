//! Accepts connections on the loopback interface: one thread each, of a limited number.

use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, Once};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};

use super::access::Access;
use super::hub::Hub;
use super::page;
use super::request::{Head, Refusal, Request};
use super::response;
use super::socket;
use super::token::Token;
use crate::console::eprint_line;
use crate::run::panics;

/// Maximum number of connections.
const MAX_CONNECTIONS: usize = 160;
/// Time for writing a part of an answer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);
/// Stack of a connection's thread in bytes.
const STACK: usize = 512 << 10;
/// Pause after a failure to accept, such as one for lack of file handles.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// The server of the page.
pub struct Server {
    listener: TcpListener,
    token: Token,
    access: Arc<Access>,
    connections: Arc<Connections>,
    hub: Arc<Hub>,
}

impl Server {
    /// Listens on a port; 0 takes a free one.
    ///
    /// # Errors
    /// The port is in use, or the system has no random numbers.
    pub fn bind(port: u16, access: Access, hub: Arc<Hub>) -> Result<Server> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .with_context(|| format!("--port {port} cannot be listened on; use another"))?;
        let (token, access) = (Token::random()?, Arc::new(access));
        Ok(Server { listener, token, access, connections: Arc::default(), hub })
    }

    /// The port.
    ///
    /// # Errors
    /// The system does not know it.
    pub fn port(&self) -> Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    /// The address of the page, behind the proxy if there is one.
    ///
    /// # Errors
    /// The system does not know the port.
    pub fn url(&self) -> Result<String> {
        Ok(match &self.access.base_url {
            Some(base) => format!("{}{}{}/", base.origin, base.path, self.token),
            None => format!("http://{}/{}/", self.listener.local_addr()?, self.token),
        })
    }

    /// Accepts connections until the process ends.
    pub fn run(self) {
        loop {
            match self.listener.accept() {
                Ok((stream, _)) => self.start(stream),
                Err(_) => thread::sleep(ACCEPT_PAUSE),
            }
        }
    }

    /// Starts the thread of a connection. Without one, the connection is closed.
    fn start(&self, stream: TcpStream) {
        let Some(ticket) = Connections::admit(&self.connections, &stream) else { return };
        let (token, access, hub) = (self.token.clone(), self.access.clone(), self.hub.clone());
        let serve = move || {
            // A panic is reported, and ends this connection alone.
            let _ = panics::catch(|| {
                serve(stream, &token, &access, &hub, &ticket);
                Ok(())
            });
        };
        let _ = thread::Builder::new().name("viewer".into()).stack_size(STACK).spawn(serve);
    }
}

/// Answers the one request of a connection.
fn serve(mut stream: TcpStream, token: &Token, access: &Access, hub: &Arc<Hub>, ticket: &Ticket) {
    // Frames are sent at once, not after more of them.
    let _ = stream.set_nodelay(true);
    if stream.set_write_timeout(Some(WRITE_TIMEOUT)).is_err() {
        return;
    }
    let Head { request, rest } = match Head::read(&mut stream, token, access) {
        Ok(head) => head,
        Err(refusal) => {
            if let Refusal::Origin(Some(host)) = &refusal {
                warn_of_origin(host);
            }
            let _ = response::refuse(&mut stream, &refusal);
            return;
        }
    };
    // The peer is gone if the answer cannot be written.
    let _ = match request {
        Request::File(name) => match page::find(&name) {
            Some(file) => response::send_file(&mut stream, file),
            None => response::refuse(&mut stream, &Refusal::NotFound),
        },
        Request::MissingSlash => response::add_slash(&mut stream, &token.to_string()),
        Request::Socket { key } => {
            ticket.keep();
            let accepted = response::accept_socket(&mut stream, &key);
            accepted.map(|()| socket::run(stream, rest, hub))
        }
    };
}

/// Names the flag that accepts pages at a host, once: the browser does not show the answer to a socket.
fn warn_of_origin(host: &str) {
    static WARNING: Once = Once::new();
    WARNING.call_once(|| {
        eprint_line(&format!("warning: a page at {host} is refused; --allow-host {host} accepts it"));
    });
}

/// The open connections.
#[derive(Default)]
struct Connections(Mutex<OpenConnections>);

#[derive(Default)]
struct OpenConnections {
    next_id: u64,
    open: Vec<OpenConnection>,
}

struct OpenConnection {
    id: u64,
    stream: TcpStream,
    /// True for a socket, whose peer knows the token.
    is_viewer: bool,
}

impl Connections {
    /// Admits a connection. If there are too many, the oldest whose peer has not shown the token gives way.
    fn admit(connections: &Arc<Connections>, stream: &TcpStream) -> Option<Ticket> {
        let copy = stream.try_clone().ok()?;
        let mut all = connections.lock();
        if all.open.len() >= MAX_CONNECTIONS {
            let oldest = all.open.iter().position(|other| !other.is_viewer)?;
            let _ = all.open.remove(oldest).stream.shutdown(Shutdown::Both);
        }
        let id = all.next_id;
        all.next_id += 1;
        all.open.push(OpenConnection { id, stream: copy, is_viewer: false });
        Some(Ticket { id, connections: connections.clone() })
    }

    fn lock(&self) -> MutexGuard<'_, OpenConnections> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// The admission of a connection, which ends with it.
struct Ticket {
    id: u64,
    connections: Arc<Connections>,
}

impl Ticket {
    /// Marks the connection as that of a viewer.
    fn keep(&self) {
        let mut all = self.connections.lock();
        all.open.iter_mut().filter(|open| open.id == self.id).for_each(|open| open.is_viewer = true);
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        self.connections.lock().open.retain(|open| open.id != self.id);
    }
}
