"""Reads lines "NAME HEX", and prints for each what the class NAME of crccheck makes of the bytes."""
import sys

from crccheck import crc

for line in sys.stdin:
    name, data = line.split()
    print(getattr(crc, name).calchex(bytes.fromhex(data)))
