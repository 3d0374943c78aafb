"""pyvisa with pyvisa-py as client of a SCPI supply on a raw socket of this machine; prints JSON."""

import json
import sys

import pyvisa

manager = pyvisa.ResourceManager("@py")
supply = manager.open_resource(f"TCPIP::127.0.0.1::{sys.argv[1]}::SOCKET")
supply.read_termination = supply.write_termination = "\n"
supply.timeout = 3000
told = {"identity": supply.query("*IDN?")}
supply.write("SOURce:VOLTage:LEVel 27.5")
supply.write("CURR 1.5")
supply.write("OUTPut:STATe ON")
told["on"] = supply.query("OUTP?")
told["voltage"] = float(supply.query("MEASure:VOLTage?"))
told["error"] = supply.query("SYST:ERR?")
supply.write("VOLT 99")
told["refused"] = supply.query("SYSTem:ERRor?")
supply.write("FROBNICATE 1")
told["unknown"] = supply.query("SYST:ERR?")
told["kept"] = float(supply.query("VOLT?"))
supply.write("OUTP OFF")
told["off"] = supply.query("OUTP?")
supply.close()
print(json.dumps(told))
