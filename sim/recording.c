typedef int placeholder_recording;
