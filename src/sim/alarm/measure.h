// Time from a detector's pin to the UDP report that tells of it.
#pragma once

#include "alarm/network.h"

// `events` changes of detectors at random times, one after the other; what was measured, in microseconds.
nlohmann::ordered_json measureReports(AlarmNetwork& network, const AlarmOptions& options, size_t events);
