//! The playback services, with the names and types of rosbag2_interfaces.

use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cromosim_msgs::rosbag2_interfaces as srv;
use cromosim_ros::{Bell, Node, RosError, ServiceServer};

use crate::config::{Config, check_rate};
use crate::player::Player;
use crate::system_clock::system_nanos;

/// Shared between the playing loop and the services.
#[derive(Clone)]
pub struct Remote {
    shared: Arc<Mutex<Shared>>,
    bell: Arc<Bell>,
}

struct Shared {
    player: Player,
    /// Recorded time to go on at.
    seek: Option<i64>,
    /// What `seek` may be.
    seekable: RangeInclusive<i64>,
    /// Messages to publish at once while paused.
    burst: u64,
    /// Begin again at the end.
    loops: bool,
}

/// Access to the player while it is not changed by anybody else.
pub struct PlayerGuard<'a>(MutexGuard<'a, Shared>);

impl std::ops::Deref for PlayerGuard<'_> {
    type Target = Player;
    fn deref(&self) -> &Player {
        &self.0.player
    }
}

impl std::ops::DerefMut for PlayerGuard<'_> {
    fn deref_mut(&mut self) -> &mut Player {
        &mut self.0.player
    }
}

impl Remote {
    /// Control of `player` within the recorded times `seekable`; `bell` wakes the playing loop.
    pub fn new(player: Player, seekable: RangeInclusive<i64>, bell: &Arc<Bell>) -> Self {
        Self {
            shared: Arc::new(Mutex::new(Shared {
                player,
                seek: None,
                seekable,
                burst: 0,
                loops: false,
            })),
            bell: bell.clone(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The player.
    pub fn player(&self) -> PlayerGuard<'_> {
        PlayerGuard(self.lock())
    }

    /// Where a service asked to go on, once.
    pub fn take_seek(&self) -> Option<i64> {
        self.lock().seek.take()
    }

    /// True where a service asked for one more message while paused.
    pub fn take_burst(&self) -> bool {
        let mut shared = self.lock();
        let wanted = shared.burst > 0 && shared.player.paused();
        shared.burst = if wanted { shared.burst - 1 } else { 0 };
        wanted
    }

    /// Whether to begin again at the end.
    pub fn loops(&self) -> bool {
        self.lock().loops
    }

    /// Takes up the parameters that may change at run time.
    ///
    /// # Errors
    /// Where the rate is not positive.
    pub fn take_up(&self, config: &Config) -> Result<(), String> {
        check_rate(config.rate)?;
        self.change(|shared, now| {
            shared.loops = config.r#loop;
            if shared.player.rate() != config.rate {
                shared.player.set_rate(now, config.rate);
            }
        });
        Ok(())
    }

    fn change<A>(&self, change: impl FnOnce(&mut Shared, i64) -> A) -> A {
        let answer = change(&mut self.lock(), system_nanos());
        self.bell.ring();
        answer
    }

    /// Offers the services below the node's name; a rate that they set is the parameter's too.
    ///
    /// # Errors
    /// What DDS refuses.
    pub fn serve(&self, node: &Node) -> Result<Vec<ServiceServer>, RosError> {
        let remote = || self.clone();
        let (pause, resume, toggle, is_paused) = (remote(), remote(), remote(), remote());
        let (get_rate, seek, play_next, burst) = (remote(), remote(), remote(), remote());
        let parameters = node.parameters().clone();
        Ok(vec![
            node.serve::<srv::Pause>("~/pause", move |_| {
                pause.change(|shared, now| (shared.player.pause(now), Default::default()).1)
            })?,
            node.serve::<srv::Resume>("~/resume", move |_| {
                resume.change(|shared, now| (shared.player.resume(now), Default::default()).1)
            })?,
            node.serve::<srv::TogglePaused>("~/toggle_paused", move |_| {
                toggle.change(|shared, now| {
                    if shared.player.paused() {
                        shared.player.resume(now)
                    } else {
                        shared.player.pause(now)
                    }
                    Default::default()
                })
            })?,
            node.serve::<srv::IsPaused>("~/is_paused", move |_| srv::IsPausedResponse {
                paused: is_paused.player().paused(),
            })?,
            node.serve::<srv::SetRate>("~/set_rate", move |request| srv::SetRateResponse {
                success: parameters.set("rate", request.rate).is_ok(),
            })?,
            node.serve::<srv::GetRate>("~/get_rate", move |_| srv::GetRateResponse {
                rate: get_rate.player().rate(),
            })?,
            node.serve::<srv::Seek>("~/seek", move |request| {
                let recorded = request.time.nanos();
                // The playing loop moves the source and the player together.
                seek.change(|shared, _| {
                    let success = shared.seekable.contains(&recorded);
                    if success {
                        shared.seek = Some(recorded);
                    }
                    srv::SeekResponse { success }
                })
            })?,
            node.serve::<srv::PlayNext>("~/play_next", move |_| srv::PlayNextResponse {
                success: play_next.ask_for(1) == 1,
            })?,
            node.serve::<srv::Burst>("~/burst", move |request| srv::BurstResponse {
                actually_burst: burst.ask_for(request.num_messages),
            })?,
        ])
    }

    /// Asks for so many messages at once; only while paused, as in rosbag2.
    fn ask_for(&self, messages: u64) -> u64 {
        self.change(|shared, _| {
            let granted = if shared.player.paused() { messages } else { 0 };
            shared.burst = shared.burst.saturating_add(granted);
            granted
        })
    }
}
