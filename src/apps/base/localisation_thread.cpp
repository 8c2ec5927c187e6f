#include "src/apps/base/localisation_thread.hpp"

#include <utility>

namespace unimapper::apps {

LocalisationThread::LocalisationThread(LiveLocalisationOptions options)
    : localisation_(telling(options, due_)),
      thread_({[this] { return localisation_.advance(LiveLocalisation::Clock::now()); },
               "robots are localised again", "robots are not localised",
               std::move(options.report)}) {}

LiveLocalisationCounters LocalisationThread::finish() {
  thread_.finish();
  return localisation_.counters();
}

}  // namespace unimapper::apps
