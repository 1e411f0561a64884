-- Wireshark dissector of the fibre ring's transport (TL-04, docs/rules/tools.md): every field of a frame,
-- and whole messages put together from theirs.
--
--   tshark -X lua_script:src/wireshark/ring.lua -r ring.pcap -O ring
--
-- It takes data frames with identifiers of 29 bits whose addresses are possible, wherever Wireshark finds
-- CAN.

local ring = Proto("ring", "Fibre ring transport")

local LAST_ADDRESS  = 125
local PROCESS_DATA  = 15
local TO_ALL        = 0x80
local LONGEST       = 2048
local LONGEST_SHORT = 6
local FRAME         = 8
local MAP_BITS      = 40

local OPEN, SHORT, CLOSE, DONE, MISSING, BUSY, UNKNOWN, HELLO = 1, 2, 3, 0x11, 0x12, 0x13, 0x14, 0x20

-- Name, and least and greatest DLC, of each control frame.
local control = {
  [OPEN]    = { "OPEN",    8, 8 },
  [SHORT]   = { "SHORT",   3, 8 },
  [CLOSE]   = { "CLOSE",   2, 2 },
  [DONE]    = { "DONE",    4, 4 },
  [MISSING] = { "MISSING", 8, 8 },
  [BUSY]    = { "BUSY",    3, 3 },
  [UNKNOWN] = { "UNKNOWN", 1, 1 },
  [HELLO]   = { "HELLO",   8, 8 },
}
local names = {}
for code, kind in pairs(control) do names[code] = kind[1] end
local results = { [0] = "delivered", [1] = "refused", [2] = "wrong CRC" }
local types   = { [0] = "control", [1] = "data" }
local urgency = { [0] = "urgent", [1] = "normal" }

-- The identifier; masks of its 29 bits.
local f = {
  urgent      = ProtoField.uint32("ring.urgent", "Urgency", base.DEC, urgency, 0x10000000),
  destination = ProtoField.uint32("ring.dst", "Destination", base.DEC, nil, 0x0fe00000, "0 is all"),
  type        = ProtoField.uint32("ring.type", "Type", base.DEC, types, 0x00100000),
  source      = ProtoField.uint32("ring.src", "Source", base.DEC, nil, 0x000fe000),
  code        = ProtoField.uint32("ring.code", "Code", base.HEX, names, 0x00001fe0),
  number      = ProtoField.uint32("ring.number", "Frame number", base.DEC, nil, 0x00001fe0),
  object      = ProtoField.uint32("ring.object", "Object", base.DEC, nil, 0x00001fe0),
  pipe        = ProtoField.uint32("ring.pipe", "Pipe", base.DEC, nil, 0x0000001e, "15 is process data"),
  end_mark    = ProtoField.uint32("ring.end", "End mark", base.DEC, nil, 0x00000001),

  message     = ProtoField.uint8("ring.message", "Number of the message"),
  to_all      = ProtoField.bool("ring.to_all", "About a message to all", 8, nil, TO_ALL),
  life        = ProtoField.uint8("ring.life", "Life of the sender", base.DEC, nil, 0x7f),
  length      = ProtoField.uint16("ring.length", "Bytes of the message"),
  crc         = ProtoField.uint32("ring.crc", "CRC-32 of the message", base.HEX),
  own_life    = ProtoField.uint8("ring.own_life", "Life of the receiver", base.DEC),
  result      = ProtoField.uint8("ring.result", "Result", base.DEC, results),
  first       = ProtoField.uint8("ring.first_missing", "First missing frame"),
  map         = ProtoField.bytes("ring.map", "Map of missing frames"),
  missing     = ProtoField.uint16("ring.missing", "Missing frame"),
  wait        = ProtoField.uint16("ring.wait", "Wait", base.DEC, nil, nil, "in ms"),
  data        = ProtoField.bytes("ring.data", "Part of a message"),
  value       = ProtoField.bytes("ring.value", "Value"),
  valid       = ProtoField.bool("ring.valid", "There is a valid value"),

  hello_life  = ProtoField.uint8("ring.hello.life", "Life", base.DEC, nil, 0x7f),
  hello_ring  = ProtoField.uint8("ring.hello.state", "Ring state", base.HEX, nil, nil, "register 0x0012"),
  hello_ports = ProtoField.uint8("ring.hello.ports", "Ports", base.HEX, nil, nil, "register 0x0013"),
  hello_f     = ProtoField.uint8("ring.hello.can_f", "Status of CAN port F", base.HEX),
  hello_t     = ProtoField.uint8("ring.hello.can_t", "Status of CAN port T", base.HEX),
  hello_type  = ProtoField.uint16("ring.hello.type", "Device type", base.HEX),
  hello_vers  = ProtoField.uint8("ring.hello.version", "Version", base.DEC),

  -- Found by following the message.
  opened_in   = ProtoField.framenum("ring.opened_in", "Message begins in"),
  whole_in    = ProtoField.framenum("ring.whole_in", "Message is whole in"),
  whole       = ProtoField.bytes("ring.whole", "Whole message"),
  crc_right   = ProtoField.bool("ring.crc_right", "CRC-32 is right"),
}
ring.fields = f

local function info(name, text, group, severity)
  return ProtoExpert.new("ring." .. name .. ".expert", text, expert.group[group], expert.severity[severity])
end
local e = {
  dlc     = info("dlc", "Impossible DLC", "MALFORMED", "ERROR"),
  code    = info("code", "Unknown code", "MALFORMED", "ERROR"),
  field   = info("field", "Impossible field", "MALFORMED", "ERROR"),
  crc     = info("crc", "Wrong CRC-32", "CHECKSUM", "ERROR"),
  refused = info("result", "Not delivered", "RESPONSE_CODE", "WARN"),
  fits    = info("fits", "Does not fit the open message", "SEQUENCE", "WARN"),
}
ring.experts = { e.dlc, e.code, e.field, e.crc, e.refused, e.fits }

local can_id  = Field.new("can.id")
local can_xtd = Field.new("can.flags.xtd")
local can_rtr = Field.new("can.flags.rtr")
local can_err = Field.new("can.flags.err")

-- Wireshark may hand out a frame many times, in any order; only the first time, in order, changes anything.
local open  -- per pipe, the message whose frames come
local about -- per frame of the recording, the message it is about

function ring.init()
  open  = {}
  about = {}
end

-- `count` bits of a number, from bit `at` on. (`bit` is Wireshark's own, in all its versions;
-- `bit32` and operators for bits depend on that of Lua.)
local function bits(number, at, count) return math.floor(math.floor(number / 2 ^ at) % 2 ^ (count or 1)) end

local crc_table = {}
for i = 0, 255 do
  local c = i
  for _ = 1, 8 do
    c = bit.band(c, 1) == 1 and bit.bxor(bit.rshift(c, 1), 0xedb88320) or bit.rshift(c, 1)
  end
  crc_table[i] = c
end

local function crc32(bytes)
  local c = -1
  for i = 0, bytes:len() - 1 do
    c = bit.bxor(crc_table[bit.band(bit.bxor(c, bytes:get_index(i)), 0xff)], bit.rshift(c, 8))
  end
  return bit.bnot(c)
end

local function key(source, destination, pipe) return source * 4096 + destination * 16 + pipe end

-- True for a number that is older than that of the pipe's message in the same life (TP-02, TP-21).
local function is_old(m, number, life)
  local behind = m and m.life == life and (m.number - number) % 256 or 0
  return behind >= 1 and behind <= 127
end

-- Puts the message together, once all its frames have come.
local function complete(m, at)
  local bytes = ByteArray.new()
  for i = 0, m.frames - 1 do bytes:append(m.parts[i]) end
  m.whole, m.whole_in, m.is_right = bytes, at, crc32(bytes) == bit.tobit(m.crc)
end

local function opens(pipe, at, number, life, length, crc)
  local m = open[pipe]
  local is_same = m and m.number == number and m.life == life and m.length == length and m.crc == crc
  -- The open message goes on (TP-21), also when it has been whole: its DONE was lost, or nobody had room.
  -- With a wrong CRC all frames come again (TP-24): that is another one, and the wrong one stays as it is.
  if is_same and not (m.whole and not m.is_right) then
    m.has_ended = false
  else
    m = { number = number, life = life, length = length, crc = crc, opened_in = at, parts = {}, count = 0,
          frames = math.floor((length + FRAME - 1) / FRAME) }
    open[pipe] = m
  end
  return m
end

-- True if a data frame has the DLC and end mark that number and length ask for (TP-03, TP-22).
local function fits(m, number, is_end, length)
  local is_last = number == m.frames - 1
  local dlc     = is_last and m.length - FRAME * number or FRAME
  return number < m.frames and is_end == is_last and length == dlc
end

local function follow_data(pipe, at, number, is_end, tvb)
  local m = open[pipe]
  -- Behind DONE and CLOSE they are of a newer message, whose OPEN was lost.
  if not m or m.has_ended or m.length == 0 or not fits(m, number, is_end, tvb:len()) then return nil end
  if m.whole or m.parts[number] then return m end
  m.parts[number] = tvb:bytes()
  m.count = m.count + 1
  if m.count == m.frames then complete(m, at) end
  return m
end

local function show_identifier(tree, id)
  local kind = bits(id, 20)
  -- The bytes of the identifier are no part of what CAN's dissector hands on.
  local word = ByteArray.new(string.format("%08x", id)):tvb("Identifier")
  local all  = word:range(0, 4)
  local number = f.code
  if kind == 1 then number = bits(id, 1, 4) == PROCESS_DATA and f.object or f.number end
  for _, field in ipairs { f.urgent, f.destination, f.type, f.source, number, f.pipe, f.end_mark } do
    tree:add(field, all)
  end
end

local function show_life(tree, range, destination_is_all)
  local item = tree:add(f.to_all, range)
  tree:add(f.life, range)
  if destination_is_all ~= nil and destination_is_all ~= (range:uint() >= TO_ALL) then
    item:add_proto_expert_info(e.field, "The life byte does not fit the destination")
  end
end

local function show_message(tree, m, at)
  if not m then return end
  if m.opened_in ~= at then tree:add(f.opened_in, m.opened_in):set_generated() end
  if not m.whole_in then return end
  if m.whole_in ~= at then
    tree:add(f.whole_in, m.whole_in):set_generated()
  elseif m.whole then
    tree:add(f.whole, m.whole:tvb("Message"):range()):set_generated()
    local item = tree:add(f.crc_right, m.is_right):set_generated()
    if not m.is_right then item:add_proto_expert_info(e.crc) end
  end
end

-- What stands behind number and life.
local rest = {
  [OPEN] = function(tree, t)
    local length = t(2, 2):uint() + 1
    local item = tree:add(f.length, t(2, 2), length)
    tree:add(f.crc, t(4, 4))
    if length <= LONGEST_SHORT or length > LONGEST then
      item:add_proto_expert_info(e.field, "No length of a message that is opened")
    end
  end,
  [SHORT] = function(tree, t) tree:add(f.whole, t(2)) end,
  [CLOSE] = function() end,
  [DONE] = function(tree, t)
    tree:add(f.own_life, t(2, 1))
    local item, result = tree:add(f.result, t(3, 1)), t(3, 1):uint()
    if result > 2 then item:add_proto_expert_info(e.field, "Impossible result")
    elseif result > 0 then item:add_proto_expert_info(e.refused) end
    return ", " .. (results[result] or result)
  end,
  [MISSING] = function(tree, t)
    local first = t(2, 1):uint()
    tree:add(f.first, t(2, 1))
    local item, count = tree:add(f.map, t(3, 5)), 0
    for i = 0, MAP_BITS - 1 do
      if t(3, 5):bitfield(i) == 1 then
        item:add(f.missing, t(3 + math.floor(i / 8), 1), first + i)
        count = count + 1
      end
    end
    if count == 0 then item:add_proto_expert_info(e.field, "It names nothing") end
    return ", " .. count .. " from " .. first .. " on"
  end,
  [BUSY] = function(tree, t)
    local ms = 10 * t(2, 1):uint()
    tree:add(f.wait, t(2, 1), ms)
    return ", " .. ms .. " ms"
  end,
}

local function show_hello(tree, t)
  tree:add(f.hello_life, t(0, 1))
  for i, field in ipairs { f.hello_ring, f.hello_ports, f.hello_f, f.hello_t } do tree:add(field, t(i, 1)) end
  tree:add(f.hello_type, t(5, 2))
  tree:add(f.hello_vers, t(7, 1))
end

-- A control frame whose code and DLC are right.
local function show_control(tree, t, code, id, at, is_new)
  local source, destination = bits(id, 13, 7), bits(id, 21, 7)
  if code == HELLO then
    show_hello(tree, t)
    if destination ~= 0 then tree:add_proto_expert_info(e.field, "HELLO goes to all") end
    return ""
  end
  local is_answer = code >= DONE
  if is_answer and destination == 0 then tree:add_proto_expert_info(e.field, "An answer goes to one node") end
  if code == UNKNOWN then
    show_life(tree, t(0, 1))
    if t(0, 1):uint() % TO_ALL ~= 0 then tree:add_proto_expert_info(e.field, "Its life is 0") end
    return ""
  end
  local number, life = t(0, 1):uint(), t(1, 1):uint()
  tree:add(f.message, t(0, 1))
  if is_answer then show_life(tree, t(1, 1)) else show_life(tree, t(1, 1), destination == 0) end
  local more = rest[code](tree, t) or ""
  if is_new then
    local pipe = bits(id, 1, 4)
    local of   = key(source, destination, pipe)
    if is_answer then of = key(destination, life >= TO_ALL and 0 or source, pipe) end
    local m = open[of]
    if code == OPEN then
      m = is_old(m, number, life) and m or opens(of, at, number, life, t(2, 2):uint() + 1, t(4, 4):uint())
    elseif code == SHORT and not is_old(m, number, life) then
      local is_again = m and m.number == number and m.life == life and m.length == 0
      if not is_again then m = { number = number, life = life, length = 0, opened_in = at, whole_in = at } end
      open[of] = m
    end
    if m and m.number == number and bits(m.life, 0, 7) == bits(life, 0, 7) then
      about[at] = m
      -- Of a message to all, others may still want frames.
      if code == CLOSE or (code == DONE and t(3, 1):uint() <= 1 and life < TO_ALL) then m.has_ended = true end
    end
  end
  return " " .. number .. more
end

local function show(t, pinfo, root, id)
  local source, destination = bits(id, 13, 7), bits(id, 21, 7)
  local number, pipe, is_end = bits(id, 5, 8), bits(id, 1, 4), id % 2 == 1
  local at, is_new = pinfo.number, not pinfo.visited
  local tree = root:add(ring, t())
  local text
  show_identifier(tree, id)
  if bits(id, 20) == 0 then
    local kind = control[number]
    text = kind and kind[1] or string.format("code 0x%02x", number)
    if not is_end then tree:add_proto_expert_info(e.field, "A control frame has the end mark") end
    if pipe == PROCESS_DATA then tree:add_proto_expert_info(e.field, "Pipe 15 is process data") end
    if not kind then
      tree:add_proto_expert_info(e.code)
    elseif t:len() < kind[2] or t:len() > kind[3] then
      tree:add_proto_expert_info(e.dlc)
    else
      text = text .. show_control(tree, t, number, id, at, is_new)
    end
  elseif pipe == PROCESS_DATA then
    text = "object " .. number
    tree:add(f.valid, t:len() > 0)
    if t:len() > 0 then tree:add(f.value, t()) else text = text .. ", no valid value" end
    if not is_end then tree:add_proto_expert_info(e.field, "Process data have the end mark") end
  else
    text = "data " .. number .. (is_end and ", end" or "")
    if t:len() > 0 then tree:add(f.data, t()) end
    if t:len() == 0 or (t:len() < FRAME and not is_end) then tree:add_proto_expert_info(e.dlc) end
    if is_new then
      about[at] = follow_data(key(source, destination, pipe), at, number, is_end, t) or false
    end
    if not about[at] then tree:add_proto_expert_info(e.fits) end
  end
  show_message(tree, about[at], at)
  pinfo.cols.protocol = "RING"
  pinfo.cols.src      = tostring(source)
  pinfo.cols.dst      = destination == 0 and "all" or tostring(destination)
  pinfo.cols.info     = (id < 0x10000000 and "urgent, " or "") .. "pipe " .. pipe .. ", " .. text
  tree:append_text(string.format(", %d to %s, pipe %d, %s", source, destination == 0 and "all" or destination,
                                 pipe, text))
end

ring:register_heuristic("can", function(tvb, pinfo, root)
  local id, xtd, rtr, err = can_id(), can_xtd(), can_rtr(), can_err()
  if not (id and xtd and xtd.value) or (rtr and rtr.value) or (err and err.value) or tvb:len() > FRAME then
    return false
  end
  local source, destination = bits(id.value, 13, 7), bits(id.value, 21, 7)
  if source == 0 or source > LAST_ADDRESS or destination > LAST_ADDRESS then return false end
  show(tvb, pinfo, root, id.value)
  return true
end)
