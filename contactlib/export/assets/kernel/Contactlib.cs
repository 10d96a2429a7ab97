// The force of contactlib.c in C#, written by contactlib @version@ beside it; contactlib.h documents each
// number with its unit and sign. Build the library, and this file with its example:
//     cc -shared -fPIC -O2 -ffp-contract=off contactlib.c -lm -o libcontactlib.so
//     mcs Contactlib.cs && mono Contactlib.exe
// For Windows: cl /LD /O2 contactlib.c /link /EXPORT:contactlib_start /EXPORT:contactlib_force
// /EXPORT:contactlib_step
using System;
using System.Globalization;
using System.Runtime.InteropServices;

public static class Contactlib {
    /// Relative tolerance of the slip over an implicit step.
    public const double Tolerance = @tolerance@;

@csharp@
    /// A contact between two steps: Start fills it; set its input before each Step.
    [StructLayout(LayoutKind.Sequential)]
    public struct Element {
        public Parameters contact;
        public double effective_inverse_mass, @implicit, parallel_exchange;
        public Input input;
        public Output output;
        public double step_size_hint;
        public Memory memory;
        public double substep, held_tolerance, max_substeps;
    }

    /// Fill in parameters and inputs of the model.
    public static void Start(out Element element) { contactlib_start(out element); }

    /// Force at an input, with partial derivatives.
    public static void Force(ref Parameters parameters, ref Input input, ref Output output) {
        Check(contactlib_force(ref parameters, ref input, ref output));
    }

    /// A step with the inputs held. If it fails, the element is unchanged.
    public static void Step(ref Element element, double step, double tolerance = Tolerance) {
        Check(contactlib_step(ref element, step, tolerance));
    }

    static void Check(IntPtr error) {
        if (error != IntPtr.Zero) throw new ArgumentException(Marshal.PtrToStringAnsi(error));
    }

    [DllImport("contactlib", CallingConvention = CallingConvention.Cdecl)]
    static extern void contactlib_start(out Element element);
    [DllImport("contactlib", CallingConvention = CallingConvention.Cdecl)]
    static extern IntPtr contactlib_force(ref Parameters parameters, ref Input input,
                                          ref Output output);
    [DllImport("contactlib", CallingConvention = CallingConvention.Cdecl)]
    static extern IntPtr contactlib_step(ref Element element, double step, double tolerance);
}

/// The wheel of example.c, under a torque that grows until it slips away.
static class Example {
    static void Main() {
        const double step = 0.01;
        Contactlib.Element wheel;
        Contactlib.Start(out wheel);
        double radius = wheel.contact.radius, load = wheel.input.normal_load;
        double inertia = radius * radius / wheel.effective_inverse_mass;
        double largest = 1.5 * wheel.contact.static_friction * load * radius;
        Console.WriteLine("time [s]  torque [N.m]  omega [rad/s]  creepage [1]  force [N]");
        for (int i = 0; i <= 200; i++) {
            double torque = largest * i / 200;
            Contactlib.Step(ref wheel, step);
            if (i % 10 == 0)
                Console.WriteLine(string.Format(
                    CultureInfo.InvariantCulture, "{0,8:F2} {1,13:F0} {2,14:F3} {3,13:F5} {4,10:F0}",
                    step * i, torque, wheel.input.omega, wheel.output.creepage,
                    wheel.output.creep_force));
            wheel.input.omega += step * (torque + wheel.output.wheel_torque) / inertia;
        }
    }
}
