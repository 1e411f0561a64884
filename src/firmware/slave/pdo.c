/* PDO mapping (0x16nn, 0x1Ann) and assignment (0x1C12, 0x1C13): objects that say which entries stand where in
 * the process data. */
#include "internal.h"

enum { ASSIGNMENTS = 0x1c10 };

static bool is_mapping(uint16_t index, bool outputs) {
  return index >= (outputs ? 0x1600 : 0x1a00) && index <= (outputs ? 0x17ff : 0x1bff);
}
static uint16_t assignment_of(const struct slave_process *process) {
  return (uint16_t)(ASSIGNMENTS + process->sync_manager);
}
static bool is_assignment(const struct slave *slave, uint16_t index, bool outputs) {
  const struct slave_process *process = outputs ? &slave->device->outputs : &slave->device->inputs;
  return process->most > 0 && index == assignment_of(process);
}

bool pdo_is_configuration(uint16_t index) {
  return is_mapping(index, true) || is_mapping(index, false) ||
         (index > ASSIGNMENTS && index < ASSIGNMENTS + 16);
}

/* A number in a mapping: index, subindex, bits. Null with `*code` 0: padding. */
static const struct object_entry *mapped(const struct slave *slave, uint32_t number, bool outputs,
                                         uint32_t *code) {
  const uint16_t index = (uint16_t)(number >> 16);
  const uint8_t subindex = (uint8_t)(number >> 8), bits = (uint8_t)number;
  *code = bits == 0 ? SDO_NOT_MAPPABLE : 0;
  if (index == 0) return 0;
  const struct object *object = slave_object(slave, index);
  const struct object_entry *entry = object ? entry_of(object, subindex) : 0;
  if (!entry) *code = object ? SDO_NO_SUBINDEX : SDO_NO_OBJECT;
  else if (entry->bits != bits || !(entry->access & (outputs ? ACCESS_RX : ACCESS_TX)))
    *code = SDO_NOT_MAPPABLE;
  return entry;
}

/* Bits of a mapping object; what it maps goes to `to`, if that is not null. */
static uint32_t follow_mapping(const struct slave *slave, const struct object *object, bool outputs,
                               struct slave_mapped *to, uint32_t *bits, uint32_t *code) {
  const uint32_t count = slave_value(slave, object->index, 0);
  if (count > object->highest) *code = SDO_TOO_HIGH;
  for (uint16_t i = 1; i <= count && !*code; ++i) {
    const uint32_t number = slave_value(slave, object->index, (uint8_t)i);
    const struct object_entry *entry = mapped(slave, number, outputs, code);
    if (to) to[i - 1] = (struct slave_mapped){entry, (uint8_t)number};
    *bits += (uint8_t)number;
  }
  return count;
}

/* The same for all PDOs of an assignment; bytes and the number of entries. */
static uint32_t follow_assignment(const struct slave *slave, bool outputs, struct slave_mapped *to,
                                  uint16_t *bytes, uint16_t *entries) {
  const struct slave_process *process = outputs ? &slave->device->outputs : &slave->device->inputs;
  uint32_t code = 0, bits = 0, places = 0;
  *bytes = *entries = 0;
  if (process->most == 0) return 0;
  const uint16_t assignment = assignment_of(process);
  const uint32_t count = slave_value(slave, assignment, 0);
  for (uint16_t i = 1; i <= count; ++i) {
    const uint16_t index = (uint16_t)slave_value(slave, assignment, (uint8_t)i);
    const struct object *object = slave_object(slave, index);
    if (!object || !is_mapping(index, outputs)) return SDO_NOT_MAPPABLE;
    /* None twice: then all fit the places. */
    for (uint16_t k = 1; k < i; ++k)
      if (slave_value(slave, assignment, (uint8_t)k) == index) return SDO_INCOMPATIBLE;
    places += follow_mapping(slave, object, outputs, to ? to + places : 0, &bits, &code);
    if (code) return code;
  }
  if ((bits + 7) / 8 > process->most) return SDO_TOO_MUCH;
  *bytes = (uint16_t)((bits + 7) / 8);
  *entries = (uint16_t)places;
  return 0;
}

uint32_t pdo_check(const struct slave *slave, const struct object *object) {
  uint16_t bytes, entries;
  const uint32_t count = slave_value(slave, object->index, 0);
  if (count > object->highest) return SDO_TOO_HIGH;
  for (int outputs = 0; outputs < 2; ++outputs) {
    if (is_assignment(slave, object->index, outputs))
      return follow_assignment(slave, outputs, 0, &bytes, &entries);
    if (!is_mapping(object->index, outputs)) continue;
    uint32_t bits = 0, code = 0;
    follow_mapping(slave, object, outputs, 0, &bits, &code);
    const uint16_t most = outputs ? slave->device->outputs.most : slave->device->inputs.most;
    return code ? code : (bits + 7) / 8 > most ? SDO_TOO_MUCH : 0;
  }
  return 0;
}

uint16_t pdo_resolve(struct slave *slave) {
  if (follow_assignment(slave, true, slave->memory.outputs, &slave->output_bytes, &slave->output_count))
    return AL_CODE_OUTPUT_MAPPING;
  if (follow_assignment(slave, false, slave->memory.inputs, &slave->input_bytes, &slave->input_count))
    return AL_CODE_INPUT_MAPPING;
  return AL_CODE_NONE;
}

bool pdo_maps_output(const struct slave *slave, const struct object_entry *entry) {
  for (uint16_t i = 0; i < slave->output_count; ++i)
    if (slave->memory.outputs[i].entry == entry) return true;
  return false;
}
