#include "ring_gateway.h"

#include "../ring/bytes.h"
#include "ring-gateway.h"

enum {
  INPUT_VALUES = 0x6010,
  OUTPUT_VALUES = 0x7010,
  INPUT_TABLE = 0x8010,
  OUTPUT_TABLE = 0x8020,
  OUTPUTS_VALID = 0x01 /* in the control byte */
};
enum {
  STATE_WHOLE = 0x01,
  STATE_RELAY = 0x02,
  STATE_UP_1 = 0x04,
  STATE_UP_2 = 0x08,
  STATE_CONFLICT = 0x10
};
enum { PORTS_AT = 1 }; /* in HELLO behind the life */
/* Between two looks without news. Values become old, and nodes are lost, without anything that comes. */
enum { LOOK_US = 1000 };

static uint8_t *values_of(struct gateway *g) { return (uint8_t *)&g->device.objects; }

/* --- tables --- */

static struct gateway_slot slot_of(uint32_t number) {
  return (struct gateway_slot){.node = (uint8_t)(number >> 8), .object = (uint8_t)number};
}

static struct gateway_slot slot_in(struct gateway *g, const struct object *table, uint8_t slot) {
  uint8_t bytes[GATEWAY_SLOT_BYTES];
  entry_load(values_of(g), entry_of(table, (uint8_t)(slot + 1)), bytes);
  return slot_of((uint32_t)(bytes[0] | bytes[1] << 8));
}

static bool is_possible(const struct gateway *g, struct gateway_slot slot) {
  if (slot.node == 0) return slot.object == 0;
  return slot.node <= RING_LAST_ADDRESS && slot.node != g->node.parameters.address;
}

static bool are_possible(struct gateway *g, const struct gateway_slots *of) {
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i)
    if (!is_possible(g, slot_in(g, of->table, i))) return false;
  return true;
}

/* Two that drive the same object would change it all the time. */
static bool are_different(struct gateway *g, const struct gateway_slots *of) {
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i) {
    const struct gateway_slot a = slot_in(g, of->table, i);
    for (uint8_t k = 0; k < i && a.node != 0; ++k) {
      const struct gateway_slot b = slot_in(g, of->table, k);
      if (a.node == b.node && a.object == b.object) return false;
    }
  }
  return true;
}

static void take_table(struct gateway *g, struct gateway_slots *to) {
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i) {
    const struct gateway_slot slot = slot_in(g, to->table, i);
    if (slot.node != to->slots[i].node || slot.object != to->slots[i].object) g->follows = false;
    to->slots[i] = slot;
  }
}

/* Takes both tables, or tells with an AL status code which one cannot be. */
static uint16_t take_tables(struct gateway *g) {
  if (!are_possible(g, &g->inputs)) return AL_CODE_INPUT_MAPPING;
  if (!are_possible(g, &g->outputs) || !are_different(g, &g->outputs)) return AL_CODE_OUTPUT_MAPPING;
  take_table(g, &g->inputs);
  take_table(g, &g->outputs);
  return AL_CODE_NONE;
}

/* --- outputs --- */

static void send_outputs(struct gateway *g) {
  if (!g->follows) return;
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i) {
    const struct gateway_slot slot = g->outputs.slots[i];
    uint8_t bytes[GATEWAY_SLOT_BYTES];
    if (slot.node == 0) continue;
    entry_load(values_of(g), entry_of(g->outputs.values, (uint8_t)(i + 1)), bytes);
    if (g->told && g->told_valid == g->valid && same_bytes(bytes, g->told_values[i], sizeof bytes)) continue;
    transport_object(&g->node.transport, slot.node, slot.object, bytes, g->valid ? sizeof bytes : 0);
    copy_bytes(g->told_values[i], bytes, sizeof bytes);
  }
  g->told = true;
  g->told_valid = g->valid;
}

static void set_valid(struct gateway *g, bool valid) {
  g->valid = valid;
  send_outputs(g);
}

/* --- inputs --- */

/* With a transport that does not know them the tables begin anew, outputs without a valid value. */
static void follow(struct gateway *g) {
  if (g->follows || !g->node.began) return;
  transport_forget_values(&g->node.transport);
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i) {
    const struct gateway_slot slot = g->inputs.slots[i];
    if (slot.node != 0) transport_watch(&g->node.transport, slot.node, slot.object);
  }
  g->follows = true;
  g->told = false;
  send_outputs(g);
}

/* What is not valid is 0. Whether anything has changed. */
static bool take_value(struct gateway *g, uint8_t i, bool runs, uint64_t *valid) {
  const struct gateway_slot slot = g->inputs.slots[i];
  const struct object_entry *entry = entry_of(g->inputs.values, (uint8_t)(i + 1));
  uint8_t bytes[GATEWAY_SLOT_BYTES] = {0}, last[GATEWAY_SLOT_BYTES], data[RING_FRAME_BYTES];
  if (runs && slot.node != 0) {
    bool old;
    const uint8_t length =
        transport_value(&g->node.transport, slot.node, slot.object, data, &old, g->node.now_us);
    if (length > 0 && !old) {
      copy_bytes(bytes, data, length);
      *valid |= (uint64_t)1 << i;
    }
  }
  entry_load(values_of(g), entry, last);
  if (same_bytes(bytes, last, sizeof bytes)) return false;
  entry_store(values_of(g), entry, bytes);
  return true;
}

static uint64_t number_of(const uint8_t *bytes) {
  uint64_t number = 0;
  for (unsigned i = 8; i-- > 0;) number = number << 8 | bytes[i];
  return number;
}

/* Both: whether it was another one. */
static bool renew8(uint8_t *value, uint8_t now) {
  const bool is_new = *value != now;
  *value = now;
  return is_new;
}
static bool renew64(uint64_t *value, uint64_t now) {
  const bool is_new = *value != now;
  *value = now;
  return is_new;
}

/* The picture of the ring, as inputs; while nothing runs there it is empty. Whether it has changed. */
static bool take_picture(struct gateway *g, bool runs, uint64_t valid) {
  struct ring_gateway_objects *o = &g->device.objects;
  const struct ring_picture none = {0}, *p = runs ? &g->picture : &none;
  const uint8_t ports = runs ? g->node.status[PORTS_AT] : 0;
  uint8_t state = 0;
  if (runs && p->known && p->ends[0] == 0 && p->ends[1] == 0) state |= STATE_WHOLE;
  if (runs && g->node.parameters.relay) state |= STATE_RELAY;
  if (ports & NODE_RING_UP1_MASK) state |= STATE_UP_1;
  if (ports & NODE_RING_UP2_MASK) state |= STATE_UP_2;
  if (runs && ring_node_conflict(&g->node)) state |= STATE_CONFLICT;
  bool changed = renew8(&o->object_6000_01, state);
  changed |= renew8(&o->object_6000_02, p->count);
  changed |= renew8(&o->object_6000_03, p->ends[0]);
  changed |= renew8(&o->object_6000_04, p->ends[1]);
  changed |= renew64(&o->object_6000_05, number_of(p->present));
  changed |= renew64(&o->object_6000_06, number_of(p->present + 8));
  changed |= renew64(&o->object_6000_07, valid);
  return changed;
}

static void look(struct gateway *g) {
  const bool runs = g->follows && ring_node_runs(&g->node);
  const uint32_t news = transport_news(&g->node.transport);
  const bool due = g->node.now_us - g->looked_us >= LOOK_US || !runs;
  const bool picture = due || news != g->news || g->node.status[PORTS_AT] != g->ports;
  if (!picture && g->node.transport.heard == g->heard) return;
  g->heard = g->node.transport.heard;
  g->news = news;
  g->ports = g->node.status[PORTS_AT];
  if (runs && picture) ring_picture_look(&g->picture, &g->node);
  if (due) g->looked_us = g->node.now_us;
  uint64_t valid = 0;
  bool changed = false;
  for (uint8_t i = 0; i < GATEWAY_SLOTS; ++i) changed |= take_value(g, i, runs, &valid);
  if (take_picture(g, runs, valid) || changed) slave_inputs(&g->device.slave);
}

/* --- the slave --- */

static uint16_t may_enter(void *context, uint8_t state) {
  struct gateway *g = context;
  const uint16_t code = state == AL_SAFEOP ? take_tables(g) : AL_CODE_NONE;
  if (code == AL_CODE_NONE) follow(g);
  return code;
}

static void entered(void *context, uint8_t state) {
  if (state != AL_OP) set_valid(context, false);
}

static void cycle(void *context, bool outputs_valid) {
  struct gateway *g = context;
  set_valid(g, outputs_valid && (g->device.objects.object_7000_01 & OUTPUTS_VALID) != 0);
}

static uint32_t may_write(void *context, uint16_t index, uint8_t subindex, const uint8_t *bytes,
                          uint16_t count) {
  struct gateway *g = context;
  if ((index != INPUT_TABLE && index != OUTPUT_TABLE) || subindex == 0 || count != 2) return 0;
  return is_possible(g, slot_of((uint32_t)(bytes[0] | bytes[1] << 8))) ? 0 : SDO_RANGE;
}

static void start_slave(struct gateway *g) {
  ring_gateway_start(&g->device, g->board, &g->application);
  take_tables(g);
  set_valid(g, false);
}

static struct gateway_slots slots_in(uint16_t values, uint16_t table) {
  const struct slave_device *d = &ring_gateway_device;
  return (struct gateway_slots){.values = object_find(d->objects, d->object_count, values),
                                .table = object_find(d->objects, d->object_count, table)};
}

enum ring_node_fault gateway_start(struct gateway *g, struct board *board, struct board *ring_board,
                                   const struct ring_node_parameters *parameters) {
  for (uint32_t i = 0; i < sizeof *g; ++i) ((uint8_t *)g)[i] = 0; /* too large for a literal on a stack */
  g->board = board;
  g->application = (struct slave_application){
      .context = g, .may_enter = may_enter, .entered = entered, .cycle = cycle, .may_write = may_write};
  g->inputs = slots_in(INPUT_VALUES, INPUT_TABLE);
  g->outputs = slots_in(OUTPUT_VALUES, OUTPUT_TABLE);
  const enum ring_node_fault fault = ring_node_start(&g->node, ring_board, parameters);
  g->starts = g->node.starts;
  start_slave(g);
  return fault;
}

/* Nobody is there who would take messages. */
static void refuse_messages(struct gateway *g) {
  const struct transport_message *m;
  while ((m = transport_received(&g->node.transport)) != 0) transport_take(&g->node.transport, m, true);
}

/* Frames leave at the end only, when outputs are those of this pass: what has ended does not leave as valid
 * once more. */
void gateway_serve(struct gateway *g) {
  ring_node_look(&g->node);
  ring_conflict_look(&g->conflict, &g->node);
  /* Both sides are one chip: it was reset, or is there only now, and has heard nothing of the slave stack. */
  if (g->node.starts != g->starts) start_slave(g);
  g->starts = g->node.starts;
  follow(g);
  if (g->node.began) refuse_messages(g);
  look(g);
  slave_serve(&g->device.slave);
  if (!g->node.began) return;
  const uint64_t look_at = g->looked_us + LOOK_US;
  ring_node_poll(&g->node);
  if (look_at < g->node.due_us) g->node.due_us = look_at;
}

void gateway_wait(struct gateway *g, uint32_t most_us) { ring_node_wait(&g->node, most_us); }
