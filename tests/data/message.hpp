// What an error says.
#pragma once

#include <string>

#include "blockid/data/error.hpp"

namespace blockid::testing {

/// The message of the Error that the action throws; "no error" when it throws none. Other exceptions pass.
template <class Action>
std::string message_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace blockid::testing

// The message of the Error thrown by an expression of any type.
#define BLOCKID_MESSAGE(...) ::blockid::testing::message_of([&] { static_cast<void>(__VA_ARGS__); })
