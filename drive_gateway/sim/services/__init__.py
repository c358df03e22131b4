"""What every CANopen node has (CiA 301): an object dictionary, and the services by which a master reaches it.

In go SDO requests, process data and the time; out come answers, frames, and changes of objects, which their owners
guard and follow. It knows nothing of drives: what an object does is the business of whoever registered for it.
"""
