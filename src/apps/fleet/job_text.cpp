#include "src/apps/fleet/job_text.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "unimapper/config/config_json.hpp"

namespace unimapper::apps {
namespace {

using JobJson = nlohmann::json;

JobJson numbers_of(const Pose& pose) {
  JobJson numbers = JobJson::array();
  for (const double number : pose.rotation.reshaped()) numbers.push_back(number);
  for (const double number : pose.translation) numbers.push_back(number);
  return numbers;
}

double number_in(const JobJson& value) {
  if (!value.is_number()) throw std::runtime_error("a number is missing");
  return value.get<double>();
}

const JobJson& array_in(const JobJson& value, std::size_t size) {
  if (!value.is_array() || value.size() != size) {
    throw std::runtime_error("an array of " + std::to_string(size) + " is missing");
  }
  return value;
}

Pose pose_in(const JobJson& value) {
  const JobJson& numbers = array_in(value, 12);
  Pose pose;
  for (int i = 0; i < 9; ++i) {
    pose.rotation.reshaped()[i] = number_in(numbers[static_cast<std::size_t>(i)]);
  }
  for (int i = 0; i < 3; ++i) {
    pose.translation[i] = number_in(numbers[static_cast<std::size_t>(9 + i)]);
  }
  return pose;
}

JobJson id_of(KeyframeId k) { return JobJson::array({k.session, k.keyframe}); }

/// A conversion would make a number of a negative one, or of one that is too large.
std::uint32_t index_in(const JobJson& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xFFFFFFFFU) {
    throw std::runtime_error("a number of a keyframe is missing");
  }
  return value.get<std::uint32_t>();
}

KeyframeId id_in(const JobJson& value) {
  const JobJson& numbers = array_in(value, 2);
  return {index_in(numbers[0]), index_in(numbers[1])};
}

merge::JobKeyframe keyframe_in(const JobJson& value) {
  const JobJson& up = array_in(value.at("up"), 4);
  return {id_in(value.at("id")),
          value.at("name").get<std::string>(),
          pose_in(value.at("T_odometry_keyframe")),
          {up[0].get<bool>(), up[1].get<float>(), up[2].get<float>(), up[3].get<float>()}};
}

KeyedOutcome outcome_in(const JobJson& value) {
  KeyedOutcome keyed;
  keyed.key = value.at("key").get<std::string>();
  keyed.outcome.T_match_query = pose_in(value.at("T_match_query"));
  const JobJson& information = array_in(value.at("information"), 36);
  for (int i = 0; i < 36; ++i) {
    keyed.outcome.information.reshaped()[i] = number_in(information[static_cast<std::size_t>(i)]);
  }
  keyed.outcome.overlap = number_in(value.at("overlap"));
  keyed.outcome.decision.reason = value.at("reason").get<std::string>();
  keyed.outcome.decision.accepted = keyed.outcome.decision.reason.empty();
  return keyed;
}

/// Levels of a job and more: writing a value back takes stack for each.
constexpr int kMostLevels = 16;

/// What `read` makes of a JSON object; its exceptions in words.
template <typename Read>
auto parsed(std::string_view text, const char* what, const Read& read) {
  const auto limit_levels = [](int level, JobJson::parse_event_t /*event*/, JobJson& /*value*/) {
    if (level > kMostLevels) throw std::runtime_error("a job or an answer is nested too deeply");
    return true;
  };
  try {
    return read(JobJson::parse(text, limit_levels));
  } catch (const JobJson::exception& error) {
    throw std::runtime_error(std::string(what) + " is damaged: " + error.what());
  }
}

}  // namespace

std::string job_text(const merge::LoopJob& job) {
  JobJson keyframes = JobJson::array();
  for (const merge::JobKeyframe& k : job.keyframes) {
    keyframes.push_back(
        {{"id", id_of(k.id)},
         {"name", k.name},
         {"T_odometry_keyframe", numbers_of(k.T_odometry_keyframe)},
         {"up", {k.up.known, k.up.variance_x, k.up.covariance_xy, k.up.variance_y}}});
  }
  JobJson questions = JobJson::array();
  for (const merge::LoopQuestion& question : job.questions) {
    questions.push_back({{"query", id_of(question.query)},
                         {"match", id_of(question.match)},
                         {"T_match_query", numbers_of(question.T_match_query)},
                         {"fingerprint", question.fingerprint}});
  }
  return JobJson{{"name", job.name},
                 {"merge", job.merge},
                 {"config", JobJson::parse(dump_config(job.config))},
                 {"limit", {job.limit.translation_m, job.limit.rotation_rad}},
                 {"keyframes", keyframes},
                 {"questions", questions}}
      .dump(-1, ' ', false, JobJson::error_handler_t::replace);
}

merge::LoopJob job_from(std::string_view text) {
  return parsed(text, "a job", [](const JobJson& value) {
    merge::LoopJob job;
    job.name = value.at("name").get<std::string>();
    job.merge = value.at("merge").get<std::string>();
    parse_config(value.at("config").dump(), "a job", job.config);
    const JobJson& limit = array_in(value.at("limit"), 2);
    job.limit = {number_in(limit[0]), number_in(limit[1])};
    for (const JobJson& keyframe : value.at("keyframes")) {
      job.keyframes.push_back(keyframe_in(keyframe));
    }
    for (const JobJson& question : value.at("questions")) {
      job.questions.push_back({id_in(question.at("query")), id_in(question.at("match")),
                               pose_in(question.at("T_match_query")),
                               question.at("fingerprint").get<std::uint64_t>()});
    }
    return job;
  });
}

std::string answer_text(const JobAnswer& answer) {
  JobJson outcomes = JobJson::array();
  for (const KeyedOutcome& keyed : answer.outcomes) {
    JobJson information = JobJson::array();
    for (const double number : keyed.outcome.information.reshaped()) information.push_back(number);
    outcomes.push_back({{"key", keyed.key},
                        {"T_match_query", numbers_of(keyed.outcome.T_match_query)},
                        {"information", information},
                        {"overlap", keyed.outcome.overlap},
                        {"reason", keyed.outcome.decision.reason}});
  }
  return JobJson{{"job", answer.job},
                 {"worker", answer.worker},
                 {"fault", answer.fault},
                 {"outcomes", outcomes}}
      .dump(-1, ' ', false, JobJson::error_handler_t::replace);
}

JobAnswer answer_from(std::string_view text) {
  return parsed(text, "an answer", [](const JobJson& value) {
    JobAnswer answer;
    answer.job = value.at("job").get<std::string>();
    answer.worker = value.at("worker").get<std::string>();
    answer.fault = value.at("fault").get<std::string>();
    for (const JobJson& outcome : value.at("outcomes"))
      answer.outcomes.push_back(outcome_in(outcome));
    return answer;
  });
}

}  // namespace unimapper::apps
