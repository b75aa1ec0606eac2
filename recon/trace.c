typedef int placeholder_trace;
