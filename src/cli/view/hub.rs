//! Work of all viewers for the one thread that renders: the newest state of each, in fair turns.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::messages::{PickMessage, ViewMessage};
use super::outbox::Outbox;
use super::quality::NextFrame;
use blinn_core::cancellation::CancelToken;

/// Maximum number of times that other viewers interrupt the refinement of a frame, unless it takes [`LONG_REFINEMENT`].
const MAX_INTERRUPTIONS: u32 = 3;
/// Frames that took this long are interrupted regardless of [`MAX_INTERRUPTIONS`].
const LONG_REFINEMENT: Duration = Duration::from_secs(2);

/// A viewer by its number.
pub type ViewerId = u64;

/// The work of all viewers.
#[derive(Default)]
pub struct Hub {
    state: Mutex<HubState>,
    is_due: Condvar,
    /// Signals that the scene was loaded again.
    is_reloaded: Condvar,
}

#[derive(Default)]
struct HubState {
    viewers: BTreeMap<ViewerId, Viewer>,
    next_id: ViewerId,
    /// The viewer that had the last turn.
    last: ViewerId,
    running: Option<Running>,
    needs_reload: bool,
    /// The scene of the list to open.
    open: Option<usize>,
    /// Number of times that the scene was loaded again, or could not be.
    reloads: u64,
}

/// The frame that is being rendered.
struct Running {
    viewer: ViewerId,
    is_refinement: bool,
    since: Instant,
    cancel: CancelToken,
}

struct Viewer {
    outbox: Arc<Outbox>,
    needs_scene: bool,
    pick: Option<PickMessage>,
    /// The newest state, and the next frame of it.
    message: Option<Arc<ViewMessage>>,
    next: Option<NextFrame>,
    /// Number of times that the frame was interrupted.
    interruptions: u32,
    /// Seconds for a sample of a pixel, from recent frames.
    cost: Option<f64>,
}

/// The next thing to do.
pub enum Turn {
    /// Load the scene again.
    Reload,
    /// Load another scene of the list, for all viewers.
    Open(usize),
    Viewer {
        id: ViewerId,
        outbox: Arc<Outbox>,
        task: Task,
    },
}

/// Something to do for one viewer.
pub enum Task {
    /// Describe the scene.
    Scene,
    Pick {
        pick: PickMessage,
        message: Option<Arc<ViewMessage>>,
    },
    Frame {
        message: Arc<ViewMessage>,
        next: NextFrame,
        cost: Option<f64>,
        cancel: CancelToken,
    },
}

impl Hub {
    fn lock(&self) -> MutexGuard<'_, HubState> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Adds a viewer, who needs the scene first.
    pub fn join(&self, outbox: Arc<Outbox>) -> ViewerId {
        let mut state = self.lock();
        let id = state.next_id;
        state.next_id += 1;
        let viewer = Viewer {
            outbox,
            needs_scene: true,
            pick: None,
            message: None,
            next: None,
            interruptions: 0,
            cost: None,
        };
        state.viewers.insert(id, viewer);
        self.is_due.notify_one();
        id
    }

    /// Removes a viewer, with its frame.
    pub fn leave(&self, id: ViewerId) {
        let mut state = self.lock();
        state.viewers.remove(&id);
        state.cancel(|running| running.viewer == id);
    }

    /// Replaces the state of a viewer. Ends a frame of the one before, and lets a new picture come before the refinement
    /// of another viewer's.
    pub fn show(&self, id: ViewerId, message: ViewMessage) {
        let mut state = self.lock();
        let next = NextFrame::first_of(&message);
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.message = Some(Arc::new(message));
        viewer.next = Some(next);
        viewer.interruptions = 0;
        state.cancel(|running| running.viewer == id);
        state.interrupt_refinement();
        self.is_due.notify_one();
    }

    /// Requests the object at a pixel. Only the last request is kept.
    pub fn pick(&self, id: ViewerId, pick: PickMessage) {
        let mut state = self.lock();
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.pick = Some(pick);
        state.interrupt_refinement();
        self.is_due.notify_one();
    }

    /// Returns true while a viewer waits for something. If that is new, it interrupts another viewer's refinement once
    /// this has taken long.
    pub fn is_busy(&self, id: ViewerId) -> bool {
        let state = self.lock();
        let Some(viewer) = state.viewers.get(&id) else { return false };
        if viewer.has_new_work() {
            state.interrupt_refinement();
        }
        let is_running = state.running.as_ref().is_some_and(|running| running.viewer == id);
        is_running || viewer.has_work()
    }

    /// Requests another scene of the list, for all viewers. Only the last request is kept.
    pub fn open(&self, file: usize) {
        let mut state = self.lock();
        state.open = Some(file);
        state.cancel(|_| true);
        self.is_due.notify_one();
    }

    /// Has the scene loaded again at the next turn, and waits until it is.
    pub fn reload(&self) {
        let mut state = self.lock();
        state.needs_reload = true;
        state.cancel(|_| true);
        self.is_due.notify_one();
        let before = state.reloads;
        while state.reloads == before {
            state = self.is_reloaded.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Notes that the scene was loaded again, or could not be.
    pub fn reloaded(&self) {
        self.lock().reloads += 1;
        self.is_reloaded.notify_all();
    }

    /// The messages that wait for all viewers.
    pub fn outboxes(&self) -> Vec<Arc<Outbox>> {
        self.lock().viewers.values().map(|viewer| viewer.outbox.clone()).collect()
    }

    /// The states that viewers show.
    pub fn messages(&self) -> Vec<(ViewerId, Option<Arc<ViewMessage>>)> {
        self.lock().viewers.iter().map(|(id, viewer)| (*id, viewer.message.clone())).collect()
    }

    /// Gives all viewers the scene again, with a state of the new one for each, and renders that.
    pub fn replace_scene(&self, messages: Vec<(ViewerId, Option<ViewMessage>)>) {
        let mut state = self.lock();
        for (id, message) in messages {
            let Some(viewer) = state.viewers.get_mut(&id) else { continue };
            viewer.needs_scene = true;
            viewer.cost = None;
            if let Some(message) = message {
                viewer.next = Some(NextFrame::first_of(&message));
                viewer.message = Some(Arc::new(message));
            }
        }
    }

    /// The newest state of a viewer.
    pub fn message(&self, id: ViewerId) -> Option<Arc<ViewMessage>> {
        self.lock().viewers.get(&id)?.message.clone()
    }

    /// Waits for work and takes the next turn: viewers in the order of their numbers, beginning after the last; new
    /// requests before refinements.
    pub fn next_turn(&self) -> Turn {
        let mut state = self.lock();
        state.running = None;
        loop {
            if let Some(file) = state.open.take() {
                return Turn::Open(file);
            }
            if std::mem::take(&mut state.needs_reload) {
                return Turn::Reload;
            }
            if let Some(turn) = state.take_turn() {
                return turn;
            }
            state = self.is_due.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Notes that a frame is done, its cost, and the one after it, unless the viewer has another state by now.
    pub fn frame_done(&self, id: ViewerId, serial: u64, cost: Option<f64>, next: Option<NextFrame>) {
        let mut state = self.lock();
        state.running = None;
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        viewer.cost = match (viewer.cost, cost) {
            (Some(old), Some(new)) => Some(0.5 * (old + new)),
            (old, new) => new.or(old),
        };
        if viewer.next.is_none() && viewer.message.as_ref().is_some_and(|message| message.serial == serial) {
            viewer.next = next;
        }
    }

    /// Notes that a frame was cancelled. Another viewer's interruption repeats it.
    pub fn frame_cancelled(&self, id: ViewerId, serial: u64, next: NextFrame) {
        let mut state = self.lock();
        state.running = None;
        let Some(viewer) = state.viewers.get_mut(&id) else { return };
        if viewer.next.is_none() && viewer.message.as_ref().is_some_and(|message| message.serial == serial) {
            viewer.next = Some(next);
            viewer.interruptions += 1;
        }
    }
}

impl Viewer {
    fn has_work(&self) -> bool {
        self.needs_scene || self.pick.is_some() || self.next.is_some()
    }

    /// Returns true if no frame of the viewer's newest request was shown yet.
    fn has_new_work(&self) -> bool {
        let is_refined = self.next.is_none_or(NextFrame::is_refinement);
        self.needs_scene || self.pick.is_some() || !is_refined
    }
}

impl HubState {
    fn cancel(&self, condition: impl Fn(&Running) -> bool) {
        if let Some(running) = self.running.as_ref().filter(|running| condition(running)) {
            running.cancel.cancel();
        }
    }

    /// Ends a refinement, unless that happened too often.
    fn interrupt_refinement(&self) {
        self.cancel(|running| {
            let viewer = self.viewers.get(&running.viewer);
            let is_spared = viewer.is_some_and(|viewer| viewer.interruptions >= MAX_INTERRUPTIONS);
            running.is_refinement && (!is_spared || running.since.elapsed() > LONG_REFINEMENT)
        });
    }

    fn take_turn(&mut self) -> Option<Turn> {
        let after = self.viewers.range(self.last + 1..).map(|(id, viewer)| (*id, viewer));
        let before = self.viewers.range(..=self.last).map(|(id, viewer)| (*id, viewer));
        let order: Vec<(ViewerId, bool, bool)> =
            after.chain(before).map(|(id, viewer)| (id, viewer.has_new_work(), viewer.has_work())).collect();
        let first_new = order.iter().find(|(_, is_new, _)| *is_new);
        let (id, ..) = *first_new.or_else(|| order.iter().find(|(.., has_work)| *has_work))?;
        self.last = id;
        let viewer = self.viewers.get_mut(&id)?;
        let outbox = viewer.outbox.clone();
        let message = viewer.message.clone();
        let task = if std::mem::take(&mut viewer.needs_scene) {
            Task::Scene
        } else if let Some(pick) = viewer.pick.take() {
            Task::Pick { pick, message }
        } else {
            let next = viewer.next.take()?;
            let cancel = CancelToken::new();
            let is_refinement = next.is_refinement();
            let since = Instant::now();
            self.running = Some(Running { viewer: id, is_refinement, since, cancel: cancel.clone() });
            Task::Frame { message: message?, next, cost: viewer.cost, cancel }
        };
        Some(Turn::Viewer { id, outbox, task })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::state::{CameraState, ViewState};

    fn message(serial: u64) -> ViewMessage {
        let view = ViewState {
            camera: CameraState::File { index: 0 },
            hidden: Vec::new(),
            variant: None,
            animation: None,
            time: 0.0,
            lights: String::new(),
            exposure: Default::default(),
            view_transform: String::new(),
            hdri: None,
            hdri_rotate: 0.0,
            background: String::new(),
            ground: false,
            ao: 0,
            samples: 4,
        };
        ViewMessage { serial, moving: false, size: (64, 36), view }
    }

    /// Takes a turn that is a frame: the viewer, its frame and the token that ends it.
    fn frame(hub: &Hub) -> (ViewerId, NextFrame, CancelToken) {
        match hub.next_turn() {
            Turn::Viewer { id, task: Task::Frame { next, cancel, .. }, .. } => (id, next, cancel),
            _ => panic!("another turn"),
        }
    }

    /// A hub of viewers that have their scene.
    fn hub(viewers: usize) -> Hub {
        let hub = Hub::default();
        for _ in 0..viewers {
            hub.join(Arc::default());
        }
        for _ in 0..viewers {
            assert!(matches!(hub.next_turn(), Turn::Viewer { task: Task::Scene, .. }));
        }
        hub
    }

    const FIRST: NextFrame = NextFrame::First { is_only: false };

    #[test]
    fn viewers_take_turns_and_first_frames_come_before_refinements() {
        let hub = hub(3);
        (0..3).for_each(|id| hub.show(id, message(1)));
        let mut firsts = Vec::new();
        for _ in 0..3 {
            let (id, next, _) = frame(&hub);
            assert_eq!(next, FIRST);
            hub.frame_done(id, 1, None, Some(NextFrame::Final));
            firsts.push(id);
        }
        firsts.sort();
        assert_eq!(firsts, [0, 1, 2]);
        let (refined, next, cancel) = frame(&hub);
        assert_eq!(next, NextFrame::Final);
        // A gesture interrupts it and comes first; then it is repeated, or another viewer's follows.
        let other = (refined + 1) % 3;
        hub.show(other, message(2));
        assert!(cancel.is_cancelled());
        hub.frame_cancelled(refined, 1, next);
        let (id, next, _) = frame(&hub);
        assert_eq!((id, next), (other, FIRST));
        hub.frame_done(id, 2, None, None);
        let mut rest = Vec::new();
        for _ in 0..2 {
            let (id, next, _) = frame(&hub);
            assert_eq!(next, NextFrame::Final);
            hub.frame_done(id, 1, None, None);
            rest.push(id);
        }
        rest.sort();
        assert_eq!(rest, (0..3).filter(|id| *id != other).collect::<Vec<_>>());
    }

    #[test]
    fn a_short_refinement_is_interrupted_only_a_few_times() {
        let hub = hub(2);
        hub.show(0, message(1));
        let (id, ..) = frame(&hub);
        hub.frame_done(id, 1, None, Some(NextFrame::Final));
        for serial in 0..MAX_INTERRUPTIONS {
            let (id, next, cancel) = frame(&hub);
            assert_eq!((id, next), (0, NextFrame::Final));
            hub.show(1, message(serial.into()));
            assert!(cancel.is_cancelled());
            hub.frame_cancelled(0, 1, next);
            assert_eq!(frame(&hub).0, 1);
            hub.frame_done(1, serial.into(), None, None);
        }
        let (.., cancel) = frame(&hub);
        hub.show(1, message(99));
        assert!(hub.is_busy(1) && !cancel.is_cancelled());
        // A long one gives way in the end.
        if let Some(running) = hub.lock().running.as_mut() {
            running.since -= 2 * LONG_REFINEMENT;
        }
        assert!(hub.is_busy(0) && !cancel.is_cancelled());
        assert!(hub.is_busy(1) && cancel.is_cancelled());
        hub.frame_cancelled(0, 1, NextFrame::Final);
        assert_eq!(frame(&hub).0, 1);
        hub.frame_done(1, 99, None, None);
        let (.., cancel) = frame(&hub);
        hub.show(1, message(100));
        // Its own viewer ends it at any time.
        hub.show(0, message(2));
        assert!(cancel.is_cancelled());
        hub.frame_cancelled(0, 1, NextFrame::Final);
        let turns = [frame(&hub), frame(&hub)].map(|(id, next, _)| (id, next));
        assert!(turns.contains(&(0, FIRST)) && turns.contains(&(1, FIRST)));
    }

    #[test]
    fn another_scene_comes_before_frames() {
        let hub = hub(1);
        hub.show(0, message(1));
        let (.., cancel) = frame(&hub);
        (0..3).for_each(|file| hub.open(file));
        assert!(cancel.is_cancelled());
        hub.frame_cancelled(0, 1, FIRST);
        assert!(matches!(hub.next_turn(), Turn::Open(2)));
        assert_eq!(frame(&hub).1, FIRST);
    }

    #[test]
    fn what_a_viewer_leaves_is_forgotten() {
        let hub = hub(2);
        hub.show(0, message(1));
        let (id, next, cancel) = frame(&hub);
        hub.leave(0);
        assert!(cancel.is_cancelled());
        hub.frame_cancelled(id, 1, next);
        assert!(!hub.is_busy(0) && hub.outboxes().len() == 1);
        hub.show(1, message(1));
        assert_eq!(frame(&hub).0, 1);
    }
}
