// What an access of each kind takes, as fast as the host may make it.
#pragma once

#include "hosts/host.h"
#include "hosts/master.h"

namespace hosts {

// Prints as JSON, for accesses of 1, 2 and 4 bytes and a block, in RAM: core cycles and ns from the beginning
// of one to the beginning of the next, the mean and the longest of `accesses`; with a quiet bus and with
// frames.
void measure(Core& core, Host& host, Master& master, Random& random, int accesses);

}  // namespace hosts
