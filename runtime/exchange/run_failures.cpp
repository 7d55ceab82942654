#include "runtime/exchange/run_failures.h"

#include <limits>
#include <string>

#include "physics/base/error.h"

namespace lahar {

namespace {

/// Empty for an exception that has no text.
std::string text_of(const std::exception_ptr& exception) {
  try {
    if (exception) std::rethrow_exception(exception);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
  }
  return "";
}

/// Throws what is no IoError on, and else the message of all ranks: equal texts are printed once.
[[noreturn]] void throw_as_told(const std::exception_ptr& own, const std::string& message) {
  try {
    if (own) std::rethrow_exception(own);
  } catch (const IoError&) {
  }
  throw IoError(message);
}

}  // namespace

void RunFailures::add(int patch, Failure failure) {
  poisoned_[static_cast<std::size_t>(patch)] = 1;
  const Step step = failure.step;
  list_.add(std::move(failure));
  learn(step);
}

void RunFailures::throw_first(Step& step, const Communicator& ranks) {
  if (ranks.any(!list_.empty())) {
    step = ranks.min(first_step_.get());
    throw SimulationError(first_message(step, ranks));
  }
  keep(of_poll_);
  if (!ranks.any(static_cast<bool>(of_output_))) return;
  std::string message = text_of(of_output_);
  if (ranks.several()) take_first_text(ranks, static_cast<bool>(of_output_), message);
  throw_as_told(of_output_, message);
}

std::string RunFailures::first_message(Step step, const Communicator& ranks) const {
  constexpr Index none = std::numeric_limits<Index>::max();
  const bool own = list_.by(step);
  const Failure first = own ? list_.earliest() : Failure{};
  const Index stage = ranks.min(own ? Index{first.stage_index} : none);
  const bool in_stage = own && first.stage_index == stage;
  const Index patch = ranks.min(in_stage ? first.patch : none);
  const Index failed = ranks.sum(list_.count(step));
  std::string message = own ? failure_message(first, ranks.rank(), failed, counted_) : "";
  take_first_text(ranks, in_stage && first.patch == patch, message);
  return message;
}

}  // namespace lahar
