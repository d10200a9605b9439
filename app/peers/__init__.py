"""Other people's kinematics with our hand in them, for comparison in benchmarks only (extra "bench").

Each module has a class with what app.peers.lm asks of a `Hand`; its library is imported when the class is made.
"""
