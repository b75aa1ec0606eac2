typedef int placeholder_simulator;
