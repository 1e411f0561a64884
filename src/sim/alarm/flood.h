// Hostile datagrams to the master, back to back at the speed of the wire, while the line goes on.
#pragma once

#include "alarm/network.h"

// `count` of each kind. Who sends them knows everything but the key. Every one of them must be counted by the
// controller, and no order among them executed; alarms are reported meanwhile. What was counted; a
// std::runtime_error if something did not come.
nlohmann::ordered_json floodMaster(AlarmNetwork& network, const AlarmOptions& options, size_t count);
