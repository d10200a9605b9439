"""Forward kinematics, Jacobians and inverse kinematics of the hand."""
