// Sender of one session's messages with a thread and a bounded queue.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <vector>

#include "ports/lcm/clock_offset.hpp"
#include "ports/lcm/latest_map_pose.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/pacing.hpp"
#include "ports/lcm/sending.hpp"
#include "unimapper/wire/delivery.hpp"
#include "unimapper/wire/sender_storage.hpp"

namespace unimapper::lcm_port {

/// Hands one datagram to the network; false if the network would not take it. Called from the
/// publisher's thread only.
using Send = std::function<bool(std::string_view channel, Bytes message)>;

/// What bases have said since the last call, of any session; returns at once. Called from the
/// publisher's thread only.
using Receive = std::function<std::vector<StoredMessage>()>;

/// A base's answer to a probe.
struct ReceivedReceipt {
  ReceiptMessage message;                         ///< what it says
  std::chrono::steady_clock::time_point arrival;  ///< when it arrived
};

/// Answers to probes since the last call, of any session; returns at once. Called from the
/// publisher's thread only.
using ReceiveReceipts = std::function<std::vector<ReceivedReceipt>()>;

/// What has arrived on the channel of map poses since the last call, of any session; returns at
/// once. Called from the publisher's thread only.
using ReceiveMapPoses = std::function<std::vector<ReceivedMapPose>()>;

/// Both directions of a network.
struct Link {
  Send send;                           ///< to the base
  Receive receive;                     ///< from the base; may be empty
  ReceiveReceipts receipts = nullptr;  ///< from the base; where empty, the rate does not adapt
  /// From the base; where empty, no place in the base's map is known.
  ReceiveMapPoses map_poses = nullptr;
};

/// Lets bytes through at an average rate, with bursts up to a bound. Time is the caller's.
class TokenBucket {
 public:
  /// The clock of the times handed in.
  using Clock = std::chrono::steady_clock;

  TokenBucket(double bytes_per_second, double burst_bytes, Clock::time_point now)
      : rate_(bytes_per_second), burst_(burst_bytes), tokens_(burst_bytes), last_(now) {}

  /// From now on so many bytes per second.
  void set_rate(double bytes_per_second, Clock::time_point now) {
    refill(now);
    rate_ = bytes_per_second;
  }
  /// From now on bursts are bounded by so many bytes.
  void set_burst(double burst_bytes) { burst_ = burst_bytes; }
  /// How long to wait before `bytes` may go; zero if now. More than a burst may go once the
  /// bucket is full.
  [[nodiscard]] Clock::duration wait_time(double bytes, Clock::time_point now);
  /// Takes the tokens of bytes that were sent.
  void take(double bytes) { tokens_ -= bytes; }

 private:
  void refill(Clock::time_point now);

  double rate_;
  double burst_;
  double tokens_;
  Clock::time_point last_;
};

/// Sizes of datagrams and queue, and the rate of sending.
struct PublisherOptions {
  std::uint32_t datagram_bytes = kLargestDatagramBytes;  ///< see `cut_into_messages`
  double bytes_per_second = 20e6;                        ///< highest rate of keyframes
  /// Lowest rate, where the link loses much; four datagrams a second if that is more.
  double min_bytes_per_second = 4000.0;
  std::uint32_t burst_bytes = 64000;  ///< what a default receive buffer takes
  std::size_t queue_capacity = 32;    ///< keyframes waiting to be sent
  /// Keyframes that were sent and not acknowledged are kept in so much memory; beyond it the
  /// oldest is evicted: read back from the storage when it is needed, counted without one. 64 MB
  /// are 200 keyframes of a VLP-16 or 60 of an OS2-128.
  std::uint64_t unacknowledged_bytes = 64000000;
  /// What a full queue does: drop its oldest keyframe (a robot in motion), or make `publish`
  /// wait (a recording that is processed faster than real time).
  bool drop_when_full = true;
  std::chrono::milliseconds session_period{1000};   ///< of session and health messages
  std::chrono::milliseconds finish_timeout{30000};  ///< longest time `finish` sends on
};

/// What a publisher did so far.
struct PublisherCounters {
  std::uint64_t keyframes_published = 0;  ///< handed over, or resumed
  /// Neither acknowledged nor lost: in memory, or in the storage for the next start. Always 0 over
  /// a network without a way back.
  std::uint64_t keyframes_waiting = 0;
  std::uint64_t keyframes_sent = 0;          ///< handed to the network whole
  std::uint64_t keyframes_acknowledged = 0;  ///< stored by a base, which said so
  /// Sent and evicted: memory was full of them, or the session is over. A base may have them.
  std::uint64_t keyframes_unacknowledged = 0;
  std::uint64_t pieces_resent = 0;  ///< since a base said that they are missing
  /// Pushed out of the full queue, left at the end, or published after `finish`.
  std::uint64_t keyframes_dropped = 0;
  std::uint64_t messages_sent = 0;         ///< of all channels
  std::uint64_t bytes_sent = 0;            ///< of all messages sent
  std::uint64_t send_failures = 0;         ///< datagrams the network refused
  bool base_answers = false;               ///< one has said what it has of this session
  double bytes_per_second = 0.0;           ///< rate of keyframes now
  bool rate_adapts = false;                ///< to the link, since a base sends receipts
  double loss = 0.0;                       ///< share of the pieces lost lately
  std::uint64_t window_bytes = 0;          ///< what the base lets be on the way; 0: it has not said
  std::int64_t round_trip_ns = 0;          ///< to the base and back; 0: not measured
  std::optional<wire::ClockOffset> clock;  ///< of the base's clock, if measured
  bool end_confirmed = false;              ///< one has said that it knows of the session's end
  MapPoseCounters map_poses;               ///< of bases that localise robots in their map

  /// Keyframes of which neither a base nor this robot has anything any more.
  [[nodiscard]] std::uint64_t keyframes_lost() const {
    return keyframes_unacknowledged + keyframes_dropped;
  }
};

/// Sends a session: its messages once a second, keyframes as they come, cut into paced
/// datagrams. One thread hands over; the publisher's own thread does everything that may block.
/// Over a link that answers, keyframes are kept until a base has acknowledged them, and what is
/// missing there is sent again (`wire::Outbox`). With a storage, keyframes are put there first and
/// neither a full queue nor full memory loses them.
class Publisher {
 public:
  /// Throws std::invalid_argument for an impossible name, datagram size or rate. `storage` outlives
  /// it; null: memory alone.
  Publisher(SessionInfo info, Link link, const PublisherOptions& options = {},
            wire::SenderStorage* storage = nullptr);
  /// Sends over a network without a way back: whatever was sent is forgotten. Throws
  /// std::invalid_argument for an impossible name, datagram size or rate.
  Publisher(SessionInfo info, Send send, const PublisherOptions& options = {});
  /// Stops at once; what waits is lost and no end is announced. See `finish`.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Queues a keyframe. Takes a lock and moves a pointer, and with a storage copies the keyframe;
  /// blocks only if asked to (`drop_when_full`).
  void publish(EncodedKeyframe keyframe);
  /// Sends on what an earlier start of this session left in the storage: whatever the base says it
  /// misses, once it says so.
  void resume(const wire::EarlierSession& earlier);
  /// From now on keyframes go at most at this average rate. Thread safe.
  void set_bytes_per_second(double bytes_per_second);
  /// From now on this is sent with every session message.
  void set_health(HealthMessage health);
  /// Sends what waits, until all of it is acknowledged if a base answers, then the end of the
  /// session, until it is confirmed or, without an answer, three times. Blocks until done or until
  /// `finish_timeout` is over. Calls waiting in `publish` return at once. Further calls change
  /// nothing.
  PublisherCounters finish();

  /// What was sent and dropped so far. Thread safe.
  [[nodiscard]] PublisherCounters counters() const;
  /// Where the base has said last that this robot is in its map; nothing before it has. Found
  /// within 100 ms of its arrival. Thread safe.
  [[nodiscard]] std::optional<HeardMapPose> map_pose() const;

 private:
  using Clock = TokenBucket::Clock;
  enum class Phase : std::uint8_t { kRunning, kFinishing, kStopping };

  /// A keyframe that waits to be sent; without bytes it is in the storage.
  struct Queued {
    EncodedKeyframe keyframe;
    std::uint32_t bytes = 0;  ///< of the keyframe
    bool was_sent = false;    ///< at an earlier start
  };
  /// A keyframe until it is acknowledged.
  struct Held {
    std::vector<std::vector<std::uint8_t>> messages;  ///< none: in the storage
    std::uint64_t bytes = 0;
    bool refused = false;  ///< the network would not take all of them
  };

  void run();
  [[nodiscard]] bool is_done();
  void take_stored();
  void take_receipts();
  void take_map_poses();
  void apply_rate();
  void send_probe_if_due();
  [[nodiscard]] bool may_hold_early() const;
  void fill_outbox();
  void hold(const Queued& queued);
  void make_queue_room();
  bool load(std::uint32_t sequence);
  void unload(std::uint32_t sequence);
  void limit_memory();
  void send_piece(const wire::Outbox::Piece& piece);
  void release(std::uint32_t sequence);
  void evict(std::uint32_t sequence);
  void evict_rest();
  void announce_end();
  void wait_for_work();
  void send_session(SessionState state);
  void send_session_if_due();
  /// False if the network refused it.
  bool send_message(std::string_view channel, Bytes message);
  /// Sleeps, but not beyond a stop. False if stopping.
  bool wait_for(Clock::duration duration);
  [[nodiscard]] bool must_stop(Clock::time_point now) const;

  const Link link_;
  const PublisherOptions options_;
  wire::SenderStorage* const storage_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;      ///< the thread: something to do
  std::condition_variable has_room_;  ///< `publish`: the queue shrank
  std::deque<Queued> queue_;
  std::size_t queued_in_memory_ = 0;  ///< of `queue_`, those with bytes
  std::optional<double> new_rate_;
  SessionMessage session_;
  std::optional<HealthMessage> health_;
  LatestMapPose map_pose_;
  PublisherCounters counters_;
  Phase phase_ = Phase::kRunning;
  Clock::time_point deadline_ = Clock::time_point::max();

  // The thread's own.
  TokenBucket bucket_;
  Pacing pacing_;
  ClockOffsetFilter clock_;
  Clock::time_point next_session_;
  Clock::time_point next_health_;
  Clock::time_point last_probe_;
  wire::Outbox outbox_;
  std::map<std::uint32_t, Held> held_;  ///< what `outbox_` speaks of
  std::set<std::uint32_t> loaded_;      ///< keyframes held with their messages
  std::uint64_t held_bytes_ = 0;
  std::optional<std::uint32_t> fresh_;  ///< being sent for the first time
  bool base_answers_ = false;
  bool end_confirmed_ = false;
  std::thread thread_;
};

}  // namespace unimapper::lcm_port
