"""An emulated EtherCAT bus: slave controllers with the simulated rig behind them, on a network
interface.
"""
